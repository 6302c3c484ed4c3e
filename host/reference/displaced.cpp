#include "reference/reference.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/common.hpp>

namespace palpate::reference {

namespace {

double step_of(const Axis& axis) { return (axis.upper - axis.lower) / axis.count; }
double centre_of(const Axis& axis, int i) { return axis.lower + (i + 0.5) * step_of(axis); }

/// Steps that a Gaussian reaches: 4 standard deviations. An axis of one bin is not blurred.
int reach_of(double sd, const Axis& axis) {
  return axis.count == 1 ? 0 : static_cast<int>(std::ceil(4.0 * sd / step_of(axis)));
}

double weight_of(int steps, double sd, const Axis& axis) {
  return steps == 0 ? 1.0 : std::exp(-std::pow(steps * step_of(axis) / sd, 2.0) / 2.0);
}

/// A weighted mean of likelihoods, given and returned as logs.
class LogMean {
 public:
  void add(double weight, double log_likelihood) {
    if (weight > 0.0) {
      terms_.emplace_back(weight, log_likelihood);
    }
  }
  double value() const {
    double largest = -std::numeric_limits<double>::infinity();
    for (const auto& [weight, log] : terms_) {
      largest = std::max(largest, log);
    }
    double sum = 0.0;
    double total = 0.0;
    for (const auto& [weight, log] : terms_) {
      sum += weight * std::exp(log - largest);
      total += weight;
    }
    return largest + std::log(sum / total);
  }

 private:
  std::vector<std::pair<double, double>> terms_;
};

/// G_sigma: along y, then along x.
std::vector<double> blurred_planes(const std::vector<double>& logs, const PoseLattice& lattice,
                                   double sd_mm) {
  const int nx = lattice.x_mm.count;
  const int ny = lattice.y_mm.count;
  const auto along = [&](const std::vector<double>& in, bool x) {
    const Axis& axis = x ? lattice.x_mm : lattice.y_mm;
    const int reach = reach_of(sd_mm, axis);
    std::vector<double> out;
    for (int t = 0; t < lattice.theta_rad.count; ++t) {
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          LogMean mean;
          for (int k = -reach; k <= reach; ++k) {
            const int column = x ? i + k : i;
            const int row = x ? j : j + k;
            if (column >= 0 && column < nx && row >= 0 && row < ny) {
              mean.add(weight_of(k, sd_mm, axis),
                       in[(static_cast<std::size_t>(t) * ny + row) * nx + column]);
            }
          }
          out.push_back(mean.value());
        }
      }
    }
    return out;
  };
  return along(along(logs, false), true);
}

/// The sum over angles. `moved` says how far from t the value for theta and theta + alpha comes
/// from, in bins: a distance, because the rounding of a place would let a neighbour in with a
/// weight of 1e-16, which counts where likelihoods lie far apart.
std::vector<double> summed_turns(
    const std::vector<double>& logs, const PoseLattice& lattice, double sd_rad,
    const std::function<glm::dvec2(double theta, double alpha, const glm::dvec2& t)>& moved) {
  const Axis& x = lattice.x_mm;
  const Axis& y = lattice.y_mm;
  const Axis& angle = lattice.theta_rad;
  const int reach = reach_of(sd_rad, angle);
  const bool around = std::abs(angle.upper - angle.lower - 2.0 * std::numbers::pi) < 1e-9;
  std::vector<double> out;
  for (int t = 0; t < angle.count; ++t) {
    for (int j = 0; j < y.count; ++j) {
      for (int i = 0; i < x.count; ++i) {
        LogMean mean;
        for (int k = -reach; k <= reach; ++k) {
          const bool inside = t + k >= 0 && t + k < angle.count;
          if (!inside && !around) {
            continue;
          }
          const int from = ((t + k) % angle.count + angle.count) % angle.count;
          const glm::dvec2 distance =
              moved(centre_of(angle, t), k * step_of(angle), {centre_of(x, i), centre_of(y, j)});
          const double u = x.count == 1 ? 0.0 : i + distance.x;
          const double v = y.count == 1 ? 0.0 : j + distance.y;
          for (const double column : {std::floor(u), std::floor(u) + 1.0}) {
            for (const double row : {std::floor(v), std::floor(v) + 1.0}) {
              if (column >= 0.0 && column < x.count && row >= 0.0 && row < y.count) {
                const double share = (1.0 - std::abs(u - column)) * (1.0 - std::abs(v - row));
                mean.add(weight_of(k, sd_rad, angle) * share,
                         logs[(static_cast<std::size_t>(from) * y.count +
                               static_cast<std::size_t>(row)) *
                                  x.count +
                              static_cast<std::size_t>(column)]);
              }
            }
          }
        }
        out.push_back(mean.value());
      }
    }
  }
  return out;
}

/// A distance in bins.
glm::dvec2 in_bins(const glm::dvec2& mm, const PoseLattice& lattice) {
  return mm / glm::dvec2(step_of(lattice.x_mm), step_of(lattice.y_mm));
}

glm::dvec2 turned(double theta_rad, const glm::dvec2& v) {
  return transform({{0.0, 0.0}, theta_rad}, v);
}

double log_sum(const std::vector<double>& logs) {
  const double largest = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double l : logs) {
    sum += std::exp(l - largest);
  }
  return largest + std::log(sum);
}

/// Whether two rectangles meet: the second is turned by phi, and its centre is `apart` from the
/// first's. No axis of either separates them.
bool meet(const glm::dvec2& half_a, const glm::dvec2& half_b, double phi, const glm::dvec2& apart) {
  const double c = std::abs(std::cos(phi));
  const double s = std::abs(std::sin(phi));
  const glm::dvec2 in_b = turned(-phi, apart);
  constexpr double touching_mm = 1e-3;
  return std::abs(apart.x) <= half_a.x + c * half_b.x + s * half_b.y + touching_mm &&
         std::abs(apart.y) <= half_a.y + s * half_b.x + c * half_b.y + touching_mm &&
         std::abs(in_b.x) <= half_b.x + c * half_a.x + s * half_a.y + touching_mm &&
         std::abs(in_b.y) <= half_b.y + s * half_a.x + c * half_a.y + touching_mm;
}

}  // namespace

std::vector<double> displaced_touch(const std::vector<double>& log_likelihood,
                                    const PoseLattice& lattice, const DisplacementSd& sd,
                                    const Pose& T_robot_sensor) {
  const glm::dvec2 r = T_robot_sensor.translation_mm - lattice.pivot_mm;
  return summed_turns(
      blurred_planes(log_likelihood, lattice, sd.mm), lattice, sd.rad,
      [&](double theta, double alpha, const glm::dvec2&) {
        // Places are rounded by definition.
        constexpr double parts = 1 << 20;
        const glm::dvec2 bins = in_bins(turned(theta, r) - turned(theta + alpha, r), lattice);
        return glm::dvec2(std::round(bins.x * parts), std::round(bins.y * parts)) / parts;
      });
}

std::vector<double> slipped(const std::vector<double>& log_belief, const PoseLattice& lattice,
                            const DisplacementSd& sd, const glm::dvec2& centroid_mm) {
  std::vector<double> moved =
      summed_turns(blurred_planes(log_belief, lattice, sd.mm), lattice, sd.rad,
                   [&](double, double alpha, const glm::dvec2& t) {
                     return in_bins(turned(alpha, t - centroid_mm) - (t - centroid_mm), lattice);
                   });
  const double lost = log_sum(log_belief) - log_sum(moved);
  for (double& l : moved) {
    l += lost;
  }
  return moved;
}

bool overlaps(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map) {
  glm::dvec2 low = map.origin_mm + map.cell_mm * glm::dvec2(map.nx, map.ny);
  glm::dvec2 high = map.origin_mm - map.cell_mm;
  const bool any =
      std::any_of(map.log_odds.begin(), map.log_odds.end(), [](float l) { return l > 0.0F; });
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (!any || map.log_odds[static_cast<std::size_t>(j) * map.nx + i] > 0.0F) {
        const glm::dvec2 centre = map.origin_mm + map.cell_mm * glm::dvec2(i, j);
        low = glm::min(low, centre - map.cell_mm / 2.0);
        high = glm::max(high, centre + map.cell_mm / 2.0);
      }
    }
  }
  glm::dvec2 first = touch.elements_mm.front();
  glm::dvec2 last = first;
  for (const glm::dvec2& element : touch.elements_mm) {
    first = glm::min(first, element);
    last = glm::max(last, element);
  }
  const glm::dvec2 array_centre =
      transform(T_object_robot, transform(touch.T_robot_sensor, (first + last) / 2.0));
  return meet((high - low) / 2.0, (last - first) / 2.0,
              T_object_robot.theta_rad + touch.T_robot_sensor.theta_rad,
              array_centre - (low + high) / 2.0);
}

double none_log_evidence(std::span<const Touch> touches, const PoseLattice& lattice,
                         std::span<const Hypothesis> hypotheses,
                         const std::vector<std::vector<std::vector<double>>>& log_likelihood) {
  double total_weight = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    total_weight += hypothesis.weight;
  }
  double evidence = 0.0;
  bool felt = false;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    bool known = false;  // a touch without a known element is as likely everywhere: 1
    LogMean mean;
    LogMean mean_everywhere;
    double share = 0.0;
    for (std::size_t object = 0; object < hypotheses.size(); ++object) {
      const OccupancyGrid& map = hypotheses[object].map;
      const double weight = hypotheses[object].weight;
      for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
        const double l = log_likelihood[i][object][static_cast<std::size_t>(bin)];
        mean_everywhere.add(weight, l);
        known = known || l != 0.0;
        if (overlaps(touches[i], bin_pose(lattice, bin), map)) {
          mean.add(weight, l);
          share += weight / total_weight / static_cast<double>(lattice.bins());
        }
      }
    }
    if (!known) {
      continue;
    }
    evidence += share > 0.0 ? mean.value() : mean_everywhere.value();
    if (!felt && share > 0.0) {
      evidence += std::log(share);
    }
    felt = true;
  }
  return evidence;
}

}  // namespace palpate::reference
