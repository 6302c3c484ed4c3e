#include "palpate/particle_filter.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "estimation/change_in_steps.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/kernel_sizes.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/particles/particle_draws.hpp"
#include "estimation/particles/particle_likelihood.hpp"
#include "estimation/particles/parzen_mode.hpp"
#include "gpu/command_stream.hpp"
#include "model/own_process.hpp"
#include "model/refuse.hpp"
#include "palpate/error.hpp"
#include "shaders/draw_particles.hpp"
#include "shaders/sum_weights.hpp"

namespace palpate {

namespace {

using gpu::Access;

constexpr int most_particles = 1'000'000;
// Beyond, float32 would no longer place a particle to a hundredth of a millimetre.
constexpr double widest_mm = 100'000.0;

/// Throws Error on a number of particles, a region, a noise or a rate out of range.
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

/// Throws Error where the device cannot hold so many particles, before any memory is taken.
void require_room(const ParticleOptions& options, const gpu::Context& context) {
  // Two generations, log weights in two floats and their running sums.
  constexpr VkDeviceSize bytes = 2 * sizeof(shaders::Particle) + sizeof(TwoFloat) + sizeof(float);
  const gpu::Limits& limits = context.limits();
  const VkDeviceSize limit =
      std::min({VkDeviceSize{limits.table_texels} * shaders::WEIGHT_BLOCK,  // sums of blocks
                std::min(limits.storage_range, limits.allocation) / sizeof(shaders::Particle),
                limits.memory / bytes});
  if (static_cast<VkDeviceSize>(options.particles) > limit) {
    throw Error(Fault::input, fmt::format("particles = {}: device '{}' takes at most {}; use fewer",
                                          options.particles, context.name(), limit));
  }
}

}  // namespace

struct ParticleFilter::Impl {
  Impl(Device& device, std::span<const Hypothesis> hypotheses, const ParticleOptions& wanted)
      : options(wanted),
        objects(hypotheses.size()),
        context(device.context()),
        stream(context),
        likelihood(context, stream, hypotheses, options.region, options.contact),
        parzen(context, stream, size()),
        lanes(independent_lanes(context.limits())),
        particles(of_each<shaders::Particle>("particles")),
        drawn(of_each<shaders::Particle>("particles")),
        log_weights(of_each<TwoFloat>("particle weights")),
        cumulative(of_each<float>("particle weights")),
        draw_kernel(context, {.name = "draw_particles",
                              .spirv = shaders::draw_particles,
                              .bindings = {Access::storage, Access::storage, Access::table,
                                           Access::storage, Access::storage},
                              .push_bytes = sizeof(shaders::DrawPush),
                              .constants = {lanes}}),
        sum_kernel(context, {.name = "sum_weights",
                             .spirv = shaders::sum_weights,
                             .bindings = {Access::storage, Access::storage, Access::storage},
                             .push_bytes = sizeof(shaders::uint)}),
        averages(options.alpha_slow, options.alpha_fast) {
    sums.resize(groups_of(size(), shaders::WEIGHT_BLOCK));
    bounds.reserve(sums.size());
    block_sums =
        gpu::Buffer(context, std::span(sums).size_bytes(), gpu::Memory::device, "sums of weights");
    draw_blocks = gpu::Buffer(context, sums.size() * sizeof(shaders::DrawBlock),
                              gpu::Memory::device, "sums of weights", VK_FORMAT_R32G32B32A32_SINT);
    shares = stream.uploaded(object_shares(hypotheses, options), "prior weights");
    start();
  }

  /// Room for a value of every particle.
  template <typename Value>
  gpu::Buffer of_each(std::string_view purpose) {
    return {context, size() * sizeof(Value), gpu::Memory::device, purpose};
  }

  std::size_t size() const { return static_cast<std::size_t>(options.particles); }

  /// Uniform particles of equal weight.
  void start() {
    change.forget();
    change.change([&] {
      touch = 0;
      weighed = false;
      prior_over_best = 0.0;
      averages = LikelihoodAverages(options.alpha_slow, options.alpha_fast);
      draw(shaders::DRAW_INITIAL, 0.0);
      // No evidence, equal weights; the driver compiles the kernel now, and no touch waits for it.
      likelihood.weigh({}, particles, size(), log_weights);
      sum_weights();
    });
  }

  /// Records the drawing of all particles; see shaders::DrawPush.
  void draw(shaders::uint method, double injected) {
    bounds.clear();
    if (method == shaders::DRAW_MULTINOMIAL) {
      bounds = multinomial_blocks(sums, summary, std::move(bounds));
    } else if (method == shaders::DRAW_SYSTEMATIC) {
      const auto words = philox({0, touch, shaders::RANDOM_OFFSET, 0}, key());
      bounds = systematic_blocks(sums, summary, options.particles, words[0] * 0x1p-32,
                                 std::move(bounds));
    }
    stream.upload(draw_blocks, bounds);
    const shaders::DrawPush push{
        .key_low = key()[0],
        .key_high = key()[1],
        .touch = touch,
        .particles = static_cast<shaders::uint>(size()),
        .draw = method,
        .injected = in_words(injected),
        .objects = static_cast<shaders::uint>(objects),
        .blocks = static_cast<shaders::uint>(bounds.size()),
        .half_x_mm = static_cast<float>(half(options.region.x_mm)),
        .half_y_mm = static_cast<float>(half(options.region.y_mm)),
        .half_theta_rad = static_cast<float>(half(options.region.theta_rad)),
        .motion_mm = static_cast<float>(options.motion_mm),
        .motion_rad = static_cast<float>(options.motion_rad)};
    stream.dispatch(draw_kernel, {&particles, &cumulative, &draw_blocks, &shares, &drawn}, push,
                    {groups_of(size(), lanes), 1, 1});
    std::swap(particles, drawn);
  }

  /// Sums the weights for the next drawing and for what is said of them.
  void sum_weights() {
    stream.dispatch(sum_kernel, {&log_weights, &cumulative, &block_sums},
                    static_cast<shaders::uint>(size()),
                    {static_cast<std::uint32_t>(sums.size()), 1, 1});
    stream.download(block_sums, sums);
    stream.run();
    summary = summarise(sums);
  }

  void update(const TouchEvidence& evidence) {
    known = gathered({&evidence, 1}, options.region.pivot_mm, ParticleLikelihood::longest_run,
                     std::move(known));
    ++touch;
    // A touch that says nothing moves the particles and leaves their weights: drawing anew would
    // only lose some. So would it before the first touch, when all weigh the same.
    const bool informative = !known.runs.empty();
    if (!informative || !weighed) {
      draw(shaders::DRAW_SAME, 0.0);
    } else {
      draw(options.resampling == Resampling::multinomial ? shaders::DRAW_MULTINOMIAL
                                                         : shaders::DRAW_SYSTEMATIC,
           options.augmented ? averages.injected() : 0.0);
    }
    if (!informative) {
      stream.run();
      return;
    }
    likelihood.weigh(known, particles, size(), log_weights);
    sum_weights();
    weighed = true;
    // The largest weight is the touch's log-likelihood by the particle that explains it best.
    prior_over_best += prior_log_likelihood(known, options.contact) - summary.log_largest;
    averages.add(summary.log_largest + std::log(summary.sum / static_cast<double>(size())),
                 known.from_pivot_mm.size());
  }

  struct Weighed {
    std::vector<shaders::Particle> states;  ///< as the device keeps them, about the region's centre
    std::vector<double> log_weights = {};   ///< relative to the largest, in nats
    std::vector<double> weights = {};       ///< sum to 1
  };

  Weighed download() {
    Weighed found{.states = std::vector<shaders::Particle>(size())};
    std::vector<TwoFloat> logs(size());
    stream.download(particles, found.states);
    stream.download(log_weights, logs);
    stream.run();
    double total = 0.0;
    for (const TwoFloat& log_weight : logs) {
      found.log_weights.push_back(log_weight.value() - summary.log_largest);
      found.weights.push_back(std::exp(found.log_weights.back()));
      total += found.weights.back();
    }
    for (double& weight : found.weights) {
      weight /= total;
    }
    return found;
  }

  /// Log of the summed weights of every object's particles, which may be far below what exp() can
  /// tell from 0; -infinity where an object has no particle.
  std::vector<double> log_sums(const Weighed& found) const {
    std::vector<LogSum> of_object(objects);
    for (std::size_t i = 0; i < found.states.size(); ++i) {
      of_object[found.states[i].object].add(found.log_weights[i]);
    }
    std::vector<double> logs;
    std::ranges::transform(of_object, std::back_inserter(logs), &LogSum::log);
    return logs;
  }

  Pose T_object_robot(double x_mm, double y_mm, double theta_rad) const {
    const PoseLattice& region = options.region;
    return region.T_object_robot(centre(region.x_mm) + x_mm, centre(region.y_mm) + y_mm,
                                 centre(region.theta_rad) + theta_rad);
  }

  std::array<std::uint32_t, 2> key() const {
    return {static_cast<std::uint32_t>(options.seed),
            static_cast<std::uint32_t>(options.seed >> 32)};
  }

  ParticleOptions options;
  std::size_t objects;
  gpu::Context& context;
  gpu::CommandStream stream;
  ParticleLikelihood likelihood;
  ParzenMode parzen;
  std::uint32_t lanes;  ///< of a workgroup of draw_kernel
  gpu::Buffer particles;
  gpu::Buffer drawn;  ///< those of the touch before, and the place for the next
  gpu::Buffer log_weights;
  gpu::Buffer cumulative;
  gpu::Kernel draw_kernel;
  gpu::Kernel sum_kernel;
  gpu::Buffer block_sums;
  gpu::Buffer draw_blocks;
  gpu::Buffer shares;
  std::vector<shaders::WeightBlock> sums;
  std::vector<shaders::DrawBlock> bounds;  ///< what goes to draw_blocks
  std::vector<TouchEvidence> classified;   ///< room for touches that are not classified
  KnownElements known;                     ///< of the touch that is being taken in
  WeightSummary summary;
  LikelihoodAverages averages;
  shaders::uint touch = 0;  ///< counts the touches since the start
  bool weighed = false;     ///< by any touch since the start
  /// How much more likely a map of the prior alone makes all touches since the start than the best
  /// particle does, in nats.
  double prior_over_best = 0.0;
  ChangeInSteps change{"particle filter: an update failed half-way; reset() the filter"};
  OwnProcess process;
};

ParticleFilter::ParticleFilter(Device& device, std::span<const Hypothesis> hypotheses,
                               const ParticleOptions& options) {
  validate_hypotheses(hypotheses);
  ParticleOptions checked = options;
  checked.region.collapse_fixed().validate();
  checked.contact = resolve(options.contact, hypotheses);
  validate(checked);
  require_room(checked, device.context());
  impl_ = {new Impl(device, hypotheses, checked), delete_here<Impl>};
}

ParticleFilter::Impl& ParticleFilter::impl() const { return held_here(impl_, "particle filter"); }

ParticleFilter::Impl& ParticleFilter::unbroken() const {
  Impl& held = impl();
  held.change.refuse();
  return held;
}

void ParticleFilter::reset() { impl().start(); }

void ParticleFilter::move_pivot(const glm::dvec2& pivot_mm) {
  Impl& filter = unbroken();
  // Particles are kept about the region's centre, wherever the region lies.
  filter.options.region =
      with_pivot(filter.options.region, pivot_mm, "particle filter", filter.touch > 0);
}

void ParticleFilter::update(std::span<const Touch> touches,
                            const std::function<void(double)>& progress) {
  Impl& filter = unbroken();
  // All of them before the first is taken in, for one that is not sound refuses all.
  update(evidence_of(touches, filter.options.contact, filter.classified), progress);
}

void ParticleFilter::update(std::span<const TouchEvidence> touches,
                            const std::function<void(double)>& progress) {
  Impl& filter = unbroken();
  filter.change.change([&] {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      filter.update(touches[i]);
      if (progress) {
        progress(static_cast<double>(i + 1) / static_cast<double>(touches.size()));
      }
    }
  });
}

Estimate ParticleFilter::estimate() const {
  Impl& filter = unbroken();
  const Impl::Weighed weighed = filter.download();
  Estimate estimate{.identity = std::vector<double>(filter.objects),
                    .log_evidence = filter.log_sums(weighed),
                    .mode = {}};
  for (std::size_t i = 0; i < weighed.states.size(); ++i) {
    estimate.identity[weighed.states[i].object] += weighed.weights[i];
  }
  const ParzenMaximum maximum = filter.parzen.find(weighed.states, weighed.weights);
  estimate.mode.object = static_cast<int>(maximum.object);
  estimate.mode.T_object_robot =
      filter.T_object_robot(maximum.x_mm, maximum.y_mm, maximum.theta_rad);
  estimate.mode.log_likelihood = std::log(maximum.density);
  estimate.contradicted = filter.prior_over_best > contradiction_nats;
  return estimate;
}

double ParticleFilter::effective_sample_size() const {
  Impl& filter = unbroken();
  // Rounding of the device's sums could leave the range.
  return std::clamp(filter.summary.effective_sample_size(), 1.0,
                    static_cast<double>(filter.size()));
}

std::vector<ParticleFilter::Particle> ParticleFilter::particles() const {
  Impl& filter = unbroken();
  const Impl::Weighed weighed = filter.download();
  std::vector<Particle> particles;
  for (std::size_t i = 0; i < weighed.states.size(); ++i) {
    const shaders::Particle& state = weighed.states[i];
    particles.push_back(
        {.object = static_cast<int>(state.object),
         .T_object_robot = filter.T_object_robot(state.x_mm, state.y_mm, state.theta_rad),
         .weight = weighed.weights[i]});
  }
  return particles;
}

std::uint64_t ParticleFilter::device_bytes() const {
  const Impl& filter = impl();
  std::uint64_t bytes = filter.likelihood.device_bytes() + filter.parzen.peak_bytes();
  for (const gpu::Buffer* buffer :
       {&filter.particles, &filter.drawn, &filter.log_weights, &filter.cumulative,
        &filter.block_sums, &filter.draw_blocks, &filter.shares}) {
    bytes += buffer->bytes();
  }
  return bytes;
}

}  // namespace palpate
