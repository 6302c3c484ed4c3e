#include "reference/reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate::reference {

namespace {

double max_log_probability(const Posterior& posterior) {
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t object = 0; object < posterior.weight.size(); ++object) {
    for (const double l : posterior.log_likelihood[object]) {
      largest = std::max(largest, std::log(posterior.weight[object]) + l);
    }
  }
  return largest;
}

/// Probability of every bin of one object, [theta, y, x]; those of all objects sum to 1.
std::vector<double> probabilities(const Posterior& posterior, int object) {
  const double largest = max_log_probability(posterior);
  const auto relative = [&](std::size_t o, double l) {
    return posterior.weight[o] * std::exp(l - largest);
  };
  double total = 0.0;
  for (std::size_t o = 0; o < posterior.weight.size(); ++o) {
    for (const double l : posterior.log_likelihood[o]) {
      total += relative(o, l);
    }
  }
  std::vector<double> p;
  for (const double l : posterior.log_likelihood[object]) {
    p.push_back(relative(object, l) / total);
  }
  return p;
}

}  // namespace

Pose bin_pose(const PoseLattice& lattice, std::int64_t bin) {
  const auto centre = [](const Axis& axis, std::int64_t i) {
    return axis.lower + (static_cast<double>(i) + 0.5) * (axis.upper - axis.lower) / axis.count;
  };
  const std::int64_t nx = lattice.x_mm.count;
  const std::int64_t ny = lattice.y_mm.count;
  const double theta = centre(lattice.theta_rad, bin / (nx * ny));
  const Pose turn{{0.0, 0.0}, theta};
  const glm::dvec2 turned_pivot = transform(turn, lattice.pivot_mm);
  return {{centre(lattice.x_mm, bin % nx) - turned_pivot.x,
           centre(lattice.y_mm, bin / nx % ny) - turned_pivot.y},
          theta};
}

std::vector<double> log_likelihoods(std::span<const Touch> touches, const PoseLattice& lattice,
                                    const OccupancyGrid& map, const ContactModel& model,
                                    std::size_t object) {
  std::vector<double> logs(static_cast<std::size_t>(lattice.bins()), 0.0);
  for (std::size_t bin = 0; bin < logs.size(); ++bin) {
    const Pose pose = bin_pose(lattice, static_cast<std::int64_t>(bin));
    for (const Touch& touch : touches) {
      // Eq. 13.
      logs[bin] += log_likelihood(touch, pose, map, model, object);
    }
  }
  return logs;
}

std::vector<double> identity(const Posterior& posterior) {
  std::vector<double> p;
  for (std::size_t object = 0; object < posterior.weight.size(); ++object) {
    double sum = 0.0;
    for (const double q : probabilities(posterior, static_cast<int>(object))) {
      sum += q;  // Eq. 14
    }
    p.push_back(sum);
  }
  return p;
}

Mode mode(const Posterior& posterior) {
  const double largest = max_log_probability(posterior);
  for (std::size_t object = 0; object < posterior.weight.size(); ++object) {
    const std::vector<double>& logs = posterior.log_likelihood[object];
    for (std::size_t bin = 0; bin < logs.size(); ++bin) {
      if (std::log(posterior.weight[object]) + logs[bin] == largest) {  // Eq. 15, 16
        return {static_cast<int>(object), static_cast<std::int64_t>(bin)};
      }
    }
  }
  return {};
}

std::vector<double> marginal_xy(const Posterior& posterior, int object) {
  const std::vector<double> p = probabilities(posterior, object);
  std::vector<double> sums(static_cast<std::size_t>(posterior.lattice.plane()), 0.0);
  for (std::size_t bin = 0; bin < p.size(); ++bin) {
    sums[bin % sums.size()] += p[bin];
  }
  return sums;
}

std::vector<double> marginal_theta(const Posterior& posterior, int object) {
  const std::vector<double> p = probabilities(posterior, object);
  const auto plane = static_cast<std::size_t>(posterior.lattice.plane());
  std::vector<double> sums(static_cast<std::size_t>(posterior.lattice.theta_rad.count), 0.0);
  for (std::size_t bin = 0; bin < p.size(); ++bin) {
    sums[bin / plane] += p[bin];
  }
  return sums;
}

}  // namespace palpate::reference
