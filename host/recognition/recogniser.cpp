#include "recogniser.hpp"

#include <cmath>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

std::variant<PoseHistogram, ParticleFilter> make_filter(Device& device,
                                                        const RecognitionTask& task) {
  if (const auto* particles = std::get_if<ParticleOptions>(&task.filter)) {
    return ParticleFilter(device, task.hypotheses, *particles);
  }
  return PoseHistogram(device, task.hypotheses, std::get<HistogramOptions>(task.filter));
}

}  // namespace

Recogniser::Recogniser(Device& device, const RecognitionTask& task)
    : lattice_(task.lattice()), auto_pivot_(task.auto_pivot), filter_(make_filter(device, task)) {}

void Recogniser::reset() {
  std::visit([](auto& filter) { filter.reset(); }, filter_);
  touched_ = false;
  if (auto_pivot_) {
    move_pivot({0.0, 0.0});
  }
}

void Recogniser::move_pivot(const glm::dvec2& pivot_mm) {
  std::visit([&](auto& filter) { filter.move_pivot(pivot_mm); }, filter_);
  lattice_.pivot_mm = pivot_mm;
}

void Recogniser::place_pivot(const Touch& touch) {
  if (!auto_pivot_ || touched_) {
    return;
  }
  const glm::dvec2& origin_mm = touch.T_robot_sensor.translation_mm;
  if (!(std::abs(origin_mm.x) <= farthest_mm && std::abs(origin_mm.y) <= farthest_mm)) {
    throw Error(Fault::input,
                fmt::format("the first touch's sensor is at [{}, {}] mm; keep touches within {:g} "
                            "mm of the robot frame's origin, or check the poses' unit",
                            origin_mm.x, origin_mm.y, farthest_mm));
  }
  move_pivot(origin_mm);
}

void Recogniser::update(std::span<const Touch> touches,
                        const std::function<void(double)>& progress) {
  if (!touches.empty()) {
    place_pivot(touches.front());
  }
  std::visit([&](auto& filter) { filter.update(touches, progress); }, filter_);
  touched_ = touched_ || !touches.empty();
}

void Recogniser::prepare(const Touch& touch) {
  if (auto* histogram = std::get_if<PoseHistogram>(&filter_)) {
    place_pivot(touch);
    histogram->prepare(touch);
  }
}

Estimate Recogniser::estimate() const {
  return std::visit([](const auto& filter) { return filter.estimate(); }, filter_);
}

std::optional<RefinedPose> Recogniser::refine(const Mode& mode) const {
  return histogram() != nullptr ? std::optional(histogram()->refine(mode)) : std::nullopt;
}

std::optional<double> Recogniser::effective_sample_size() const {
  const auto* particles = std::get_if<ParticleFilter>(&filter_);
  return particles != nullptr ? std::optional(particles->effective_sample_size()) : std::nullopt;
}

Marginals Recogniser::marginals(int object) const {
  if (histogram() != nullptr) {
    return histogram()->marginals(object);
  }
  Marginals sums{.grid = lattice_,
                 .xy = std::vector<double>(static_cast<std::size_t>(lattice_.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(lattice_.theta_rad.count))};
  for (const ParticleFilter::Particle& particle : std::get<ParticleFilter>(filter_).particles()) {
    if (particle.object == object) {
      const std::int64_t bin = lattice_.bin_of(particle.T_object_robot);
      sums.xy[bin % lattice_.plane()] += particle.weight;
      sums.theta[bin / lattice_.plane()] += particle.weight;
    }
  }
  return sums;
}

std::uint64_t Recogniser::device_bytes() const {
  return std::visit([](const auto& filter) { return filter.device_bytes(); }, filter_);
}

}  // namespace palpate
