#include "recognition/recogniser.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "model/random.hpp"
#include "palpate/error.hpp"
#include "recognition/marginal_grid.hpp"

namespace palpate {

namespace {

using Filter = std::variant<PoseHistogram, BoundedPosterior, ParticleFilter>;

BoundedOptions bounded_options(const RecognitionTask& task) {
  auto options = std::get<BoundedOptions>(task.filter);
  if (task.cancel_point) {
    options.cancel_point = task.cancel_point;
  }
  return options;
}

Filter make_filter(Device& device, const RecognitionTask& task) {
  if (const auto* particles = std::get_if<ParticleOptions>(&task.filter)) {
    return ParticleFilter(device, task.hypotheses, *particles);
  }
  if (std::holds_alternative<BoundedOptions>(task.filter)) {
    return BoundedPosterior(task.hypotheses, bounded_options(task));
  }
  return PoseHistogram(device, task.hypotheses, std::get<HistogramOptions>(task.filter));
}

}  // namespace

Recogniser::Recogniser(Device& device, const RecognitionTask& task)
    : lattice_(task.lattice()),
      classifier_(task.classifier()),
      auto_pivot_(task.auto_pivot),
      filter_(make_filter(device, task)) {}

Recogniser::Recogniser(const RecognitionTask& task)
    : lattice_(task.lattice()),
      classifier_(task.classifier()),
      auto_pivot_(task.auto_pivot),
      filter_(BoundedPosterior(task.hypotheses, bounded_options(task))) {}

void Recogniser::reset() {
  std::visit([](auto& filter) { filter.reset(); }, filter_);
  waiting_.clear();
  surprises_.clear();
  pivot_placed_ = false;
  touched_ = false;
  if (auto_pivot_) {
    move_pivot({0.0, 0.0});
  }
}

void Recogniser::move_pivot(const glm::dvec2& pivot_mm) {
  std::visit([&](auto& filter) { filter.move_pivot(pivot_mm); }, filter_);
  lattice_.pivot_mm = pivot_mm;
}

bool Recogniser::meets_object(const Touch& touch) const {
  const std::vector<Reading> readings = classifier_.classify(touch);
  return std::any_of(readings.begin(), readings.end(), is_contact);
}

void Recogniser::place_pivot(const Touch& touch) {
  const glm::dvec2 centre_mm = touch.T_robot_sensor * array_centre_mm(touch.elements_mm);
  if (!(std::abs(centre_mm.x) <= farthest_mm && std::abs(centre_mm.y) <= farthest_mm)) {
    throw Error(Fault::input,
                fmt::format("the first touch in contact has its array at [{}, {}] mm; keep touches "
                            "within {:g} mm of the robot frame's origin, or check the poses' unit",
                            centre_mm.x, centre_mm.y, farthest_mm));
  }
  move_pivot(centre_mm);
}

void Recogniser::update(std::span<const Touch> touches,
                        const std::function<void(double)>& progress) {
  if (!lacks_pivot()) {
    std::visit([&](auto& filter) { filter.update(touches, progress); }, filter_);
    touched_ = touched_ || !touches.empty();
    return;
  }
  std::optional<std::size_t> first;  // that meets an object
  for (std::size_t i = 0; i < touches.size(); ++i) {
    // Looks at all touches, so that a bad touch is refused before the pivot moves.
    if (meets_object(touches[i]) && !first) {
      first = i;
    }
  }
  if (!first) {
    for (const Touch& touch : touches) {
      waiting_.push_back({touch.T_robot_sensor,
                          {touch.elements_mm.begin(), touch.elements_mm.end()},
                          {touch.pressure.begin(), touch.pressure.end()},
                          {touch.valid.begin(), touch.valid.end()}});
    }
    return;
  }
  place_pivot(touches[*first]);
  std::vector<Touch> all;
  all.reserve(waiting_.size() + touches.size());
  for (const WaitingTouch& touch : waiting_) {
    all.push_back({touch.T_robot_sensor, touch.elements_mm, touch.pressure, touch.valid});
  }
  all.insert(all.end(), touches.begin(), touches.end());
  std::visit([&](auto& filter) { filter.update(all, progress); }, filter_);
  waiting_.clear();
  pivot_placed_ = true;
  touched_ = true;
}

void Recogniser::prepare(const Touch& touch) {
  auto* histogram = std::get_if<PoseHistogram>(&filter_);
  if (histogram == nullptr) {
    return;
  }
  if (lacks_pivot()) {
    // A touch that comes after waiting touches is taken in together with them, not by itself.
    if (!waiting_.empty() || !meets_object(touch)) {
      return;
    }
    place_pivot(touch);
  }
  histogram->prepare(touch);
}

Estimate Recogniser::estimate() const {
  return std::visit([](const auto& filter) { return filter.estimate(); }, filter_);
}

std::optional<RefinedPose> Recogniser::refine(const Mode& mode) const {
  return std::visit(
      [&](const auto& filter) -> std::optional<RefinedPose> {
        if constexpr (requires { filter.refine(mode); }) {
          return filter.refine(mode);
        } else {
          return {};
        }
      },
      filter_);
}

const SurpriseJudge& Recogniser::surprise_judge(const RecognitionTask& task) {
  return surprise_judge_ ? *surprise_judge_ : surprise_judge_.emplace(task);
}

std::optional<double> Recogniser::effective_sample_size() const {
  const auto* particles = std::get_if<ParticleFilter>(&filter_);
  return particles != nullptr ? std::optional(particles->effective_sample_size()) : std::nullopt;
}

Marginals Recogniser::marginals(int object) const {
  if (histogram() != nullptr) {
    return histogram()->marginals(object);
  }
  const PoseLattice grid = marginal_grid(lattice_);
  if (bounded() != nullptr) {
    return bounded()->marginals(object, grid);
  }
  Marginals sums{.grid = grid,
                 .xy = std::vector<double>(static_cast<std::size_t>(grid.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(grid.theta_rad.count))};
  for (const ParticleFilter::Particle& particle : std::get<ParticleFilter>(filter_).particles()) {
    if (particle.object == object) {
      const std::int64_t bin = grid.bin_of(particle.T_object_robot);
      sums.xy[bin % grid.plane()] += particle.weight;
      sums.theta[bin / grid.plane()] += particle.weight;
    }
  }
  return sums;
}

std::vector<PoseSample> Recogniser::sample(std::size_t count, std::uint64_t seed) const {
  if (histogram() != nullptr) {
    return histogram()->sample(count, seed);
  }
  if (bounded() != nullptr) {
    return bounded()->sample(count, seed);
  }
  const std::vector<ParticleFilter::Particle> particles =
      std::get<ParticleFilter>(filter_).particles();
  double all = 0.0;
  for (const ParticleFilter::Particle& particle : particles) {
    all += particle.weight;
  }
  Random random(seed, Stream::belief);
  std::vector<PoseSample> samples;
  auto particle = particles.begin();
  double reached = particle->weight;
  for (std::size_t i = 0; i < count; ++i) {
    const double at =
        (static_cast<double>(i) + random.uniform()) / static_cast<double>(count) * all;
    while (particle + 1 != particles.end() && reached <= at) {
      reached += (++particle)->weight;
    }
    samples.push_back({particle->object, particle->T_object_robot});
  }
  return samples;
}

std::uint64_t Recogniser::device_bytes() const {
  return std::visit(
      [](const auto& filter) -> std::uint64_t {
        if constexpr (requires { filter.device_bytes(); }) {
          return filter.device_bytes();
        } else {
          return 0;
        }
      },
      filter_);
}

}  // namespace palpate
