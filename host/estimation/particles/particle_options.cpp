#include "estimation/particles/particle_options.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "estimation/kernel_sizes.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr int most_particles = 1'000'000;
// Beyond, float32 would no longer place a particle to a hundredth of a millimetre.
constexpr double widest_mm = 100'000.0;

void require(bool sound, const char* name, double value, const char* remedy) {
  if (!sound) {
    throw Error(Fault::input, fmt::format("{} = {}: {}", name, value, remedy));
  }
}

}  // namespace

void validate(const ParticleOptions& options) {
  require(options.particles >= 1 && options.particles <= most_particles, "particles",
          options.particles, "give 1 to 1,000,000");
  for (const auto& [name, axis] : {std::pair{"region x_mm", options.region.x_mm},
                                   std::pair{"region y_mm", options.region.y_mm}}) {
    require(axis.upper - axis.lower <= widest_mm, name, axis.upper - axis.lower,
            "extends over more than 100 m; give a smaller one");
  }
  const auto is_deviation = [](double v) { return v >= 0.0 && v <= 1000.0; };
  require(is_deviation(options.motion_mm), "motion_mm", options.motion_mm, "give 0 to 1000");
  require(is_deviation(options.motion_rad), "motion_rad", options.motion_rad, "give 0 to 1000");
  require(options.alpha_slow > 0.0 && options.alpha_slow < options.alpha_fast, "alpha_slow",
          options.alpha_slow, "give a rate above 0 and below alpha_fast");
  require(options.alpha_fast <= 1.0, "alpha_fast", options.alpha_fast, "give at most 1");
}

void require_room(const ParticleOptions& options, const gpu::Context& context) {
  // Two generations, log weights in two floats and their running sums.
  constexpr VkDeviceSize bytes = 2 * sizeof(shaders::Particle) + sizeof(TwoFloat) + sizeof(float);
  const gpu::Limits& limits = context.limits();
  const VkDeviceSize most =
      std::min({VkDeviceSize{limits.table_texels} * shaders::WEIGHT_BLOCK,  // sums of blocks
                std::min(limits.storage_range, limits.allocation) / sizeof(shaders::Particle),
                limits.memory / bytes});
  if (static_cast<VkDeviceSize>(options.particles) > most) {
    throw Error(Fault::input, fmt::format("particles = {}: device '{}' takes at most {}; use fewer",
                                          options.particles, context.name(), most));
  }
}

}  // namespace palpate
