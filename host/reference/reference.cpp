#include "reference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace palpate::reference {

namespace {

double logit(double p) { return std::log(p / (1.0 - p)); }

/// log(1 / (1 + exp(-l))): the form that does not overflow on either side.
double log_logistic(double l) {
  return l >= 0.0 ? -std::log1p(std::exp(-l)) : l - std::log1p(std::exp(l));
}

glm::dvec2 robot_from_object(const Pose& T_object_robot, const glm::dvec2& p_object) {
  const double dx = p_object.x - T_object_robot.translation_mm.x;
  const double dy = p_object.y - T_object_robot.translation_mm.y;
  const double c = std::cos(T_object_robot.theta_rad);
  const double s = std::sin(T_object_robot.theta_rad);
  return {c * dx + s * dy, -s * dx + c * dy};
}

double max_log_probability(const Posterior& posterior) {
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t object = 0; object < posterior.weight.size(); ++object) {
    for (const double l : posterior.log_likelihood[object]) {
      most = std::max(most, std::log(posterior.weight[object]) + l);
    }
  }
  return most;
}

/// Probability of every bin of one object, [theta, y, x]; those of all objects sum to 1.
std::vector<double> probabilities(const Posterior& posterior, int object) {
  const double most = max_log_probability(posterior);
  const auto relative = [&](std::size_t o, double l) {
    return posterior.weight[o] * std::exp(l - most);
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

glm::dvec2 transform(const Pose& T_a_b, const glm::dvec2& p_b) {
  const double c = std::cos(T_a_b.theta_rad);
  const double s = std::sin(T_a_b.theta_rad);
  return {c * p_b.x - s * p_b.y + T_a_b.translation_mm.x,
          s * p_b.x + c * p_b.y + T_a_b.translation_mm.y};
}

std::vector<Reading> classify(const Touch& touch, const ContactClassifier& classifier) {
  const auto dead = [&](std::size_t i) { return !touch.valid.empty() && touch.valid[i] == 0; };
  double e_max = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < touch.pressure.size(); ++i) {
    if (!dead(i) && touch.pressure[i] > e_max) {
      e_max = touch.pressure[i];
    }
  }
  std::vector<Reading> readings;
  for (std::size_t i = 0; i < touch.pressure.size(); ++i) {
    const double e = touch.pressure[i];
    if (!dead(i) && e > classifier.threshold && e > classifier.ratio * e_max) {
      readings.push_back(Reading::in_contact);
    } else if (!dead(i) && e < classifier.threshold && e < classifier.ratio * e_max) {
      readings.push_back(Reading::no_contact);
    } else {
      readings.push_back(Reading::unknown);
    }
  }
  return readings;
}

double increment(Reading reading, double distance_mm, const InverseSensorModel& sensor) {
  const double m = sensor.prior;
  const double g = sensor.peak * std::exp(-distance_mm * distance_mm /
                                          (2.0 * sensor.spread_mm * sensor.spread_mm));
  switch (reading) {
    case Reading::in_contact:
      return logit(m + (1.0 - m) * g) - logit(m);
    case Reading::no_contact:
      return logit(m - m * g) - logit(m);
    case Reading::unknown:
      return 0.0;
  }
  return 0.0;
}

std::vector<double> log_odds_map(std::span<const Touch> touches, const OccupancyGrid& grid,
                                 const ContactClassifier& classifier,
                                 const InverseSensorModel& sensor) {
  std::vector<double> log_odds(static_cast<std::size_t>(grid.nx) * grid.ny, logit(sensor.prior));
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = classify(touch, classifier);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      const glm::dvec2 element_mm = transform(touch.T_robot_sensor, touch.elements_mm[k]);
      for (int j = 0; j < grid.ny; ++j) {
        for (int i = 0; i < grid.nx; ++i) {
          const double dx = grid.origin_mm.x + grid.cell_mm * i - element_mm.x;
          const double dy = grid.origin_mm.y + grid.cell_mm * j - element_mm.y;
          log_odds[static_cast<std::size_t>(j) * grid.nx + i] +=
              increment(readings[k], std::hypot(dx, dy), sensor);
        }
      }
    }
  }
  return log_odds;
}

double interpolate(const OccupancyGrid& map, double prior, const glm::dvec2& p_object_mm) {
  const double x = (p_object_mm.x - map.origin_mm.x) / map.cell_mm;
  const double y = (p_object_mm.y - map.origin_mm.y) / map.cell_mm;
  const double column = std::floor(x);
  const double row = std::floor(y);
  const auto cell = [&](double i, double j) {
    const bool inside = i >= 0.0 && i < map.nx && j >= 0.0 && j < map.ny;
    return inside ? static_cast<double>(map.at(static_cast<int>(i), static_cast<int>(j)))
                  : logit(prior);
  };
  const double fx = x - column;
  const double fy = y - row;
  return (1.0 - fy) * ((1.0 - fx) * cell(column, row) + fx * cell(column + 1.0, row)) +
         fy * ((1.0 - fx) * cell(column, row + 1.0) + fx * cell(column + 1.0, row + 1.0));
}

double log_likelihood(Reading reading, double log_odds, const ContactLikelihood& model) {
  if (reading == Reading::unknown) {
    return 0.0;
  }
  const double log_p = log_logistic(reading == Reading::in_contact ? log_odds : -log_odds);
  if (model.gamma == 0.0) {
    return log_p;
  }
  return std::log(model.gamma * model.prior + (1.0 - model.gamma) * std::exp(log_p));
}

double log_likelihood(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map,
                      const ContactClassifier& classifier, const ContactLikelihood& model) {
  const std::vector<Reading> readings = classify(touch, classifier);
  double sum = 0.0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const glm::dvec2 p_object =
        transform(T_object_robot, transform(touch.T_robot_sensor, touch.elements_mm[k]));
    sum += log_likelihood(readings[k], interpolate(map, model.prior, p_object), model);
  }
  return sum;
}

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
                                    const OccupancyGrid& map, const ContactClassifier& classifier,
                                    const ContactLikelihood& model) {
  std::vector<double> logs(static_cast<std::size_t>(lattice.bins()), 0.0);
  for (std::size_t bin = 0; bin < logs.size(); ++bin) {
    const Pose pose = bin_pose(lattice, static_cast<std::int64_t>(bin));
    for (const Touch& touch : touches) {
      logs[bin] += log_likelihood(touch, pose, map, classifier, model);
    }
  }
  return logs;
}

std::vector<double> identity(const Posterior& posterior) {
  std::vector<double> p;
  for (std::size_t object = 0; object < posterior.weight.size(); ++object) {
    double sum = 0.0;
    for (const double q : probabilities(posterior, static_cast<int>(object))) {
      sum += q;
    }
    p.push_back(sum);
  }
  return p;
}

Mode mode(const Posterior& posterior) {
  const double most = max_log_probability(posterior);
  for (std::size_t object = 0; object < posterior.weight.size(); ++object) {
    const std::vector<double>& logs = posterior.log_likelihood[object];
    for (std::size_t bin = 0; bin < logs.size(); ++bin) {
      if (std::log(posterior.weight[object]) + logs[bin] == most) {
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

double pose_error_mm(const OccupancyGrid& map, const Pose& T_object_robot_estimate,
                     const Pose& T_object_robot_truth) {
  std::vector<glm::dvec2> body;
  glm::dvec2 centroid{0.0, 0.0};
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (map.at(i, j) > 0.0F) {
        body.emplace_back(map.origin_mm.x + map.cell_mm * i, map.origin_mm.y + map.cell_mm * j);
        centroid += body.back();
      }
    }
  }
  const auto cells = static_cast<double>(body.size());
  centroid /= cells;
  double J = 0.0;
  for (const glm::dvec2& p : body) {
    J += (std::pow(p.x - centroid.x, 2) + std::pow(p.y - centroid.y, 2)) / cells;
  }
  const glm::dvec2 shift = robot_from_object(T_object_robot_estimate, centroid) -
                           robot_from_object(T_object_robot_truth, centroid);
  double turn = 0.0;
  if (map.symmetry > 0) {
    const double period = 2.0 * std::numbers::pi / map.symmetry;
    turn =
        std::remainder(T_object_robot_estimate.theta_rad - T_object_robot_truth.theta_rad, period);
  }
  return std::sqrt(shift.x * shift.x + shift.y * shift.y + 2.0 * J * (1.0 - std::cos(turn)));
}

}  // namespace palpate::reference
