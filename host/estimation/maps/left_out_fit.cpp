#include "estimation/maps/left_out_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "model/random.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

constexpr std::size_t parts = 4;
constexpr std::size_t enough = 200;  // that are judged
constexpr std::size_t least = 16;    // fewer would tell the sd to no more than a fifth of it

}  // namespace

std::optional<FitScale> scale_of(std::span<const double> z) {
  const auto n = static_cast<double>(z.size());
  FitScale scale{.mean = 0.0, .sd = 0.0};
  for (const double one : z) {
    scale.mean += one / n;
  }
  for (const double one : z) {
    scale.sd += (one - scale.mean) * (one - scale.mean) / (n - 1.0);
  }
  scale.sd = std::sqrt(scale.sd);
  return z.size() > 1 && scale.sd > 0.0 ? std::optional(scale) : std::nullopt;
}

std::optional<FitScale> left_out_fit(Device& device, const MapSource& source) {
  const std::vector<Touch> touches = source.touches.touches(0, source.touches.size());
  const ContactModel contact{.classifier = source.options.classifier, .gamma = usual_gamma};
  const std::vector<TouchEvidence> evidence = evidence_of(touches, contact);
  if (std::cmp_less(std::ranges::count_if(evidence, &TouchEvidence::in_contact), least)) {
    return {};
  }
  constexpr std::uint64_t seed = 0;
  Random random(seed, Stream::touch_order);
  std::vector<std::size_t> part(touches.size());
  for (std::size_t& one : part) {
    one = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(parts)));
  }
  MapBuilder builder(device, source.options);
  std::vector<double> z;
  for (std::size_t left_out = 0; left_out < parts && z.size() < enough; ++left_out) {
    std::vector<Touch> others;
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (part[i] != left_out) {
        others.push_back(touches[i]);
      }
    }
    builder.clear();
    builder.add(others);
    const OccupancyGrid map = builder.build(source.touches.object);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (part[i] == left_out && evidence[i].in_contact()) {
        z.push_back(evidence_fit(std::span(&evidence[i], 1), Pose{}, map, contact, 0)->z);
      }
    }
  }
  return scale_of(z);
}

}  // namespace palpate
