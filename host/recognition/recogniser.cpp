#include "recogniser.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

namespace {

std::variant<PoseHistogram, ParticleFilter> make_filter(Device& device,
                                                        const RecognitionTask& task) {
  if (const auto* particles = std::get_if<ParticleOptions>(&task.filter)) {
    return ParticleFilter(device, task.hypotheses, *particles);
  }
  return PoseHistogram(device, task.hypotheses, std::get<HistogramOptions>(task.filter));
}

/// The bin that a value falls into, the nearest one where it lies beyond all.
std::size_t bin_of(const Axis& axis, double value) {
  const double bin = axis.count > 1 ? std::floor((value - axis.lower) / axis.step()) : 0.0;
  return static_cast<std::size_t>(std::clamp(bin, 0.0, axis.count - 1.0));
}

}  // namespace

Recogniser::Recogniser(Device& device, const RecognitionTask& task)
    : lattice_(task.lattice()), filter_(make_filter(device, task)) {}

void Recogniser::reset() {
  std::visit([](auto& filter) { filter.reset(); }, filter_);
}

void Recogniser::update(std::span<const Touch> touches,
                        const std::function<void(double)>& progress) {
  if (auto* histogram = std::get_if<PoseHistogram>(&filter_)) {
    histogram->update(touches, progress);
    return;
  }
  auto& particles = std::get<ParticleFilter>(filter_);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    particles.update(touches[i]);
    if (progress) {
      progress(static_cast<double>(i + 1) / static_cast<double>(touches.size()));
    }
  }
}

void Recogniser::prepare(const Touch& touch) {
  if (auto* histogram = std::get_if<PoseHistogram>(&filter_)) {
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
  const auto& [x_mm, y_mm, theta_rad, pivot_mm] = lattice_;
  const double middle_rad = (theta_rad.lower + theta_rad.upper) / 2.0;
  Marginals sums{.xy = std::vector<double>(static_cast<std::size_t>(lattice_.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(theta_rad.count))};
  for (const ParticleFilter::Particle& particle : std::get<ParticleFilter>(filter_).particles()) {
    if (particle.object == object) {
      const Pose& T_object_robot = particle.T_object_robot;
      const glm::dvec2 at = T_object_robot * pivot_mm;
      const double turn_rad =
          wrap_angle(T_object_robot.theta_rad - middle_rad, 2.0 * std::numbers::pi);
      sums.xy[bin_of(y_mm, at.y) * x_mm.count + bin_of(x_mm, at.x)] += particle.weight;
      sums.theta[bin_of(theta_rad, middle_rad + turn_rad)] += particle.weight;
    }
  }
  return sums;
}

std::uint64_t Recogniser::device_bytes() const {
  return std::visit([](const auto& filter) { return filter.device_bytes(); }, filter_);
}

}  // namespace palpate
