#include "reference/reference.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::reference {

std::vector<double> importance_weights(std::span<const double> log_likelihoods) {
  const double largest = *std::max_element(log_likelihoods.begin(), log_likelihoods.end());
  double sum = 0.0;
  for (const double l : log_likelihoods) {
    sum += std::exp(l - largest);
  }
  std::vector<double> weights;
  for (const double l : log_likelihoods) {
    weights.push_back(std::exp(l - largest) / sum);
  }
  return weights;
}

std::vector<double> identity(std::span<const Particle> particles, int objects) {
  std::vector<double> p(static_cast<std::size_t>(objects), 0.0);
  for (const Particle& particle : particles) {
    p[static_cast<std::size_t>(particle.object)] += particle.weight;  // Eq. 9
  }
  return p;
}

double cone(const Pose& a, const Pose& b) {
  const double dtheta = std::remainder(a.theta_rad - b.theta_rad, 2.0 * std::numbers::pi);
  const double d = std::hypot(a.translation_mm.x - b.translation_mm.x,
                              a.translation_mm.y - b.translation_mm.y, dtheta);
  return std::max(0.0, 1.0 - d);  // Eq. 10
}

double parzen(std::span<const Particle> particles, int object, const Pose& pose) {
  double sum = 0.0;
  for (const Particle& particle : particles) {
    // Eq. 11; the condition is Eq. 8.
    sum += particle.object == object ? particle.weight * cone(particle.pose, pose) : 0.0;
  }
  return sum;
}

double largest_parzen(std::span<const Particle> particles, int objects, double extent_mm) {
  const int cells = static_cast<int>(extent_mm / 0.5);
  double largest = 0.0;
  for (int object = 0; object < objects; ++object) {
    for (int k = 0; k < 50; ++k) {
      for (int j = -cells; j <= cells; ++j) {
        for (int i = -cells; i <= cells; ++i) {
          const Pose point{{0.5 * i, 0.5 * j}, 0.04 * std::numbers::pi * k};
          largest = std::max(largest, parzen(particles, object, point));  // Eq. 12
        }
      }
    }
  }
  return largest;
}

}  // namespace palpate::reference
