#include "weighed_particles.hpp"

#include <cmath>

namespace palpate {

std::vector<Hypothesis> three_objects() {
  return {{random_map(31, 27, 0.5, 4.0, 81), 1.0},
          {random_map(25, 25, 0.3, 4.0, 82), 2.0},
          {random_map(14, 15, 1.0, 4.0, 83), 1.0}};
}

std::vector<double> weights_of(const ParticleFilter& filter) {
  std::vector<double> weights;
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    weights.push_back(particle.weight);
  }
  return weights;
}

double weight_error(const ParticleFilter& filter, const Touch& touch,
                    const std::vector<Hypothesis>& objects, const ParticleOptions& options,
                    std::size_t stride) {
  std::vector<double> differences;
  double mean = 0.0;
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  for (std::size_t i = 0; i < particles.size(); i += stride) {
    const ParticleFilter::Particle& particle = particles[i];
    const double expected = reference::log_likelihood(touch, particle.T_object_robot,
                                                      objects[particle.object].compared(),
                                                      options.contact, particle.object);
    differences.push_back(std::log(particle.weight) - expected);
    mean += differences.back();
  }
  mean /= static_cast<double>(differences.size());
  return largest_difference(differences, std::vector<double>(differences.size(), mean));
}

}  // namespace palpate
