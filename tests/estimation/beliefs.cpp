#include "beliefs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace palpate {

std::vector<Hypothesis> three_objects() {
  return {{random_map(31, 27, 0.5, 4.0, 81), 1.0},
          {random_map(25, 25, 0.3, 4.0, 82), 2.0},
          {random_map(14, 15, 1.0, 4.0, 83), 1.0}};
}

PoseLattice small_lattice() {
  return {.x_mm = {-5.0, 6.0, 9},
          .y_mm = {-4.0, 5.0, 10},
          .theta_rad = {0, two_pi, 12},
          .pivot_mm = {3.0, -2.0}};
}

Device lowered_device(const std::function<void(gpu::Limits&)>& lower) {
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  lower(limits);
  device.context().lower_limits(limits);
  return device;
}

std::vector<std::vector<double>> all_answers(const PoseHistogram& histogram) {
  const Estimate estimate = histogram.estimate();
  const RefinedPose refined = histogram.refine(estimate.mode);
  std::vector<std::vector<double>> told{
      estimate.identity,
      estimate.log_evidence,
      {estimate.none, estimate.mode.log_likelihood, 1.0 * estimate.mode.object,
       1.0 * estimate.mode.bin.value(), refined.T_object_robot.translation_mm.x,
       refined.T_object_robot.translation_mm.y, refined.T_object_robot.theta_rad},
      {refined.covariance.begin(), refined.covariance.end()}};
  for (int object = 0; object < static_cast<int>(estimate.identity.size()); ++object) {
    Marginals marginals = histogram.marginals(object);
    told.push_back(histogram.log_likelihood(object));
    told.push_back(std::move(marginals.xy));
    told.push_back(std::move(marginals.theta));
  }
  return told;
}

std::vector<std::vector<double>> all_answers(const ParticleFilter& filter) {
  const Estimate estimate = filter.estimate();
  std::vector<double> particles;
  for (const auto& [object, pose, weight] : filter.particles()) {
    particles.insert(particles.end(), {1.0 * object, pose.translation_mm.x, pose.translation_mm.y,
                                       pose.theta_rad, weight});
  }
  return {estimate.identity,
          {filter.effective_sample_size(), estimate.mode.log_likelihood},
          std::move(particles)};
}

double expected_log_odds_of_none(std::span<const Hypothesis> objects,
                                 const HistogramOptions& options, std::span<const Touch> touches) {
  HistogramOptions as_if_exact = options;
  as_if_exact.touch_sd = as_if_exact.slip_sd = {};
  std::vector<std::vector<std::vector<double>>> by_touch;
  for (const Touch& touch : touches) {
    by_touch.push_back(
        reference_posterior(objects, as_if_exact, std::span(&touch, 1)).log_likelihood);
  }
  const reference::Posterior posterior = reference_posterior(objects, options, touches);
  std::vector<double> evidence;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    evidence.push_back(std::log(objects[i].weight / static_cast<double>(options.lattice.bins())) +
                       log_sum(posterior.log_likelihood[i]));
  }
  return std::log(*options.none_weight) +
         reference::none_log_evidence(touches, options.lattice, objects, by_touch) -
         log_sum(evidence);
}

double log_odds_of_none(const PoseHistogram& histogram) {
  const double none = histogram.estimate().none;
  return std::log(none / (1.0 - none));
}

std::vector<double> weights_of(const ParticleFilter& filter) {
  std::vector<double> weights;
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    weights.push_back(particle.weight);
  }
  return weights;
}

double weight_error(const ParticleFilter& filter, const Touch& touch,
                    std::span<const Hypothesis> objects, const ParticleOptions& options,
                    std::size_t stride) {
  std::vector<double> differences;
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  for (std::size_t i = 0; i < particles.size(); i += stride) {
    const auto& [object, pose, weight] = particles[i];
    if (weight > 0.0) {  // weights below exp(-745) of the others are 0
      const OccupancyGrid& map = objects[static_cast<std::size_t>(object)].compared();
      differences.push_back(std::log(weight) -
                            reference::log_likelihood(touch, pose, map, options.contact, object));
    }
  }
  if (differences.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  const double mean = std::accumulate(differences.begin(), differences.end(), 0.0) /
                      static_cast<double>(differences.size());
  return largest_difference(differences, std::vector<double>(differences.size(), mean));
}

}  // namespace palpate
