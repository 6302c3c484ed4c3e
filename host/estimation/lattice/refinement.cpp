#include "refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "flattening.hpp"
#include "quadratic_peak.hpp"

namespace palpate {

namespace {

// Chosen by the mean pose error over 50 unknown letters of 15 touches on 64 x 64 x 244 bins, of
// which the modes err by 0.33 mm: the belief itself gives 0.26, its roots 4, 8, 12 and 16 give
// 0.20, 0.17, 0.17 and 0.17. Radii of 2 and 3 mm give the same within 0.01 mm, 4 mm gives 0.19.
// On 50 others, whose modes err by 0.39 mm, they leave 0.22 mm. The covariance is safe for touches
// at exact poses: the peak's error squared over it is about 1 in the mean, where 3 would be exact.
// A fixed root leaves one of the coarse bins alone after many touches: on 13 x 13 x 55 bins and 60
// others, poses of 15, 25 and 50 touches then err by 0.39, 0.35 and 0.37 mm; by 0.37, 0.30 and 0.25
// with flattening_root().
constexpr double least_root = 8.0;
constexpr double radius_mm = 2.5;
// One pass leaves 0.19 mm, two 0.18; a fourth moves nothing.
constexpr int passes = 3;
// Over 400 other unknowns, touched where the maps were and anywhere, the peak errs by 0.149 and
// 0.168 mm, the mean by 0.159 and 0.182; on 14 x 14 x 53 bins, by 0.26 and 0.40. Reaches of 1 and
// 1.3 mm and twice the root give the same within 0.02 mm. Peaks further away than a bin or two are
// of quadratics that do not fit.
constexpr double peak_root_factor = 3.0;  ///< of the mean's root: 24 for a root of 8
constexpr double peak_reach_mm = 0.8;
constexpr double farthest_peak_mm = 1.0;
// Nats per mm^2. The logs' rounding, 1e-3 nats after a thousand touches, bends them by as much.
constexpr double least_curvature = 1e-3;

struct BinIndex {
  int x = 0;
  int y = 0;
  int theta = 0;
};

/// A bin of the window: its place relative to the centre bin, in (x_mm, y_mm, theta_rad) of the
/// lattice, how far it moves the body, its turn in mm too, and its log-likelihood.
struct Sample {
  glm::dvec3 offset;
  glm::dvec3 moved_mm;
  double log_likelihood = 0.0;
  bool within_radius = false;  ///< or else a neighbour only
};

/// The indices within `reach` of one, at least its neighbours, cut off at the axis's ends.
struct Range {
  int first = 0;
  int count = 0;
};

int steps_within(double reach, const Axis& axis) {
  return axis.count == 1
             ? 0
             : std::max(1, static_cast<int>(std::min<double>(axis.count, reach / axis.step())));
}

Range clipped(int centre, int steps, const Axis& axis) {
  const int first = std::max(0, centre - steps);
  return {first, std::min(axis.count - 1, centre + steps) - first + 1};
}

/// As many bins to either side, but none of the circle's twice.
Range around_circle(int centre, int steps, const Axis& axis) {
  const int before = std::min(steps, (axis.count - 1) / 2);
  const int after = std::min(steps, axis.count / 2);
  return {centre - before, before + after + 1};
}

class Refinement {
 public:
  Refinement(const DenseBelief& belief, const PoseLattice& lattice, std::size_t object,
             const Body& body)
      : belief_(belief), lattice_(lattice), object_(object), body_(body) {}

  RefinedPose around(std::int64_t bin) {
    BinIndex centre{.x = static_cast<int>(bin % lattice_.x_mm.count),
                    .y = static_cast<int>(bin % lattice_.plane() / lattice_.x_mm.count),
                    .theta = static_cast<int>(bin / lattice_.plane())};
    for (int pass = 1;; ++pass) {
      const std::vector<Sample> samples = sample(centre);
      const double root = root_of(samples);
      glm::dvec3 mean = flattened_mean(samples, root);
      const BinIndex nearest = moved(centre, mean);
      if (pass < passes &&
          (nearest.x != centre.x || nearest.y != centre.y || nearest.theta != centre.theta)) {
        centre = nearest;
        continue;
      }
      mean = peak_near(samples, centre, mean, root).value_or(mean);
      glm::dvec3 place = place_of(centre) + mean;
      if (lattice_.full_circle()) {
        const Axis& theta = lattice_.theta_rad;
        const double period_rad = theta.upper - theta.lower;
        place.z -= period_rad * std::floor((place.z - theta.lower) / period_rad);
      }
      return {.T_object_robot = lattice_.T_object_robot(place.x, place.y, place.z),
              .covariance = covariance(samples, mean, place.z)};
    }
  }

 private:
  glm::dvec3 place_of(const BinIndex& bin) const {
    return {lattice_.x_mm.centre(bin.x), lattice_.y_mm.centre(bin.y),
            lattice_.theta_rad.centre(bin.theta)};
  }

  glm::dvec3 steps() const {
    return {lattice_.x_mm.step(), lattice_.y_mm.step(), lattice_.theta_rad.step()};
  }

  /// The bins at which the body lies within the radius of where it is at the centre, and the
  /// centre's neighbours.
  std::vector<Sample> sample(const BinIndex& centre) const {
    // A turn about the pivot moves the body's centroid, as seen from the object, along an arc.
    const glm::dvec3 place = place_of(centre);
    const glm::dvec2 lever_mm = body_.centroid_mm - glm::dvec2(place);
    const double inertia_mm2 = std::max(body_.inertia_mm2, 1e-12);
    const int theta_steps = steps_within(radius_mm / std::sqrt(inertia_mm2), lattice_.theta_rad);
    const Range theta = lattice_.full_circle()
                            ? around_circle(centre.theta, theta_steps, lattice_.theta_rad)
                            : clipped(centre.theta, theta_steps, lattice_.theta_rad);
    const double turn_rad = std::min(theta_steps * lattice_.theta_rad.step(), std::numbers::pi);
    const double reach_mm =
        radius_mm + 2.0 * std::sin(turn_rad / 2.0) * std::sqrt(glm::dot(lever_mm, lever_mm));
    const Range y = clipped(centre.y, steps_within(reach_mm, lattice_.y_mm), lattice_.y_mm);
    const Range x = clipped(centre.x, steps_within(reach_mm, lattice_.x_mm), lattice_.x_mm);
    const std::vector<double> logs =
        belief_.download(object_, {theta.first, theta.count, y.first, y.count, x.first, x.count});

    std::vector<Sample> samples;
    std::size_t k = 0;
    for (int t = theta.first; t < theta.first + theta.count; ++t) {
      const double dtheta = (t - centre.theta) * lattice_.theta_rad.step();
      const glm::dvec2 swing_mm = rotate(dtheta, lever_mm) - lever_mm;
      for (int j = y.first; j < y.first + y.count; ++j) {
        for (int i = x.first; i < x.first + x.count; ++i, ++k) {
          const glm::dvec2 shift_mm((i - centre.x) * lattice_.x_mm.step(),
                                    (j - centre.y) * lattice_.y_mm.step());
          const glm::dvec3 moved_mm(shift_mm + swing_mm, std::sqrt(inertia_mm2) * dtheta);
          const bool neighbour = std::abs(i - centre.x) <= 1 && std::abs(j - centre.y) <= 1 &&
                                 std::abs(t - centre.theta) <= 1;
          const bool within = glm::dot(moved_mm, moved_mm) <= radius_mm * radius_mm;
          if (neighbour || within) {
            samples.push_back({{shift_mm, dtheta}, moved_mm, logs[k], within});
          }
        }
      }
    }
    return samples;
  }

  static double largest(const std::vector<Sample>& samples) {
    return std::max_element(
               samples.begin(), samples.end(),
               [](const Sample& a, const Sample& b) { return a.log_likelihood < b.log_likelihood; })
        ->log_likelihood;
  }

  static double root_of(const std::vector<Sample>& samples) {
    std::vector<DisplacedBin> bins;
    for (const Sample& sample : samples) {
      if (sample.within_radius) {
        bins.push_back({sample.moved_mm, sample.log_likelihood});
      }
    }
    return flattening_root(bins, least_root);
  }

  static glm::dvec3 flattened_mean(const std::vector<Sample>& samples, double root) {
    const double top = largest(samples);
    glm::dvec3 sum{0.0};
    double total = 0.0;
    for (const Sample& sample : samples) {
      const double weight = std::exp((sample.log_likelihood - top) / root);
      sum += weight * sample.offset;
      total += weight;
    }
    return sum / total;
  }

  /// The peak of the logs near the mean, relative to the centre bin as the mean is: of a quadratic
  /// in how far the body moves. None where there is none, or beyond the region.
  std::optional<glm::dvec3> peak_near(const std::vector<Sample>& samples, const BinIndex& centre,
                                      const glm::dvec3& mean, double root) const {
    const double top = largest(samples);
    const double spin_mm = std::sqrt(std::max(body_.inertia_mm2, 1e-12));
    const glm::dvec3 place = place_of(centre) + mean;
    const glm::dvec2 lever_mm = body_.centroid_mm - glm::dvec2(place);
    const auto swing_mm = [&](double turn_rad) { return rotate(turn_rad, lever_mm) - lever_mm; };
    std::vector<WeightedValue> values;
    double farthest_rad = 0.0;
    for (const Sample& sample : samples) {
      if (!sample.within_radius) {
        continue;
      }
      const glm::dvec3 d = sample.offset - mean;
      farthest_rad = std::max(farthest_rad, std::abs(d.z));
      const glm::dvec3 moved_mm(glm::dvec2(d) + swing_mm(d.z), spin_mm * d.z);
      const double log_weight =
          (sample.log_likelihood - top) / (peak_root_factor * root) -
          glm::dot(moved_mm, moved_mm) / (2.0 * peak_reach_mm * peak_reach_mm);
      values.push_back({moved_mm, sample.log_likelihood - top, std::exp(log_weight)});
    }
    const std::array<const Axis*, 3> axes{&lattice_.x_mm, &lattice_.y_mm, &lattice_.theta_rad};
    std::array<bool, 3> varies{};
    std::transform(axes.begin(), axes.end(), varies.begin(),
                   [](const Axis* axis) { return axis->count > 1; });
    const std::optional<glm::dvec3> moved_mm = quadratic_peak(values, varies, least_curvature);
    if (!moved_mm || glm::dot(*moved_mm, *moved_mm) > farthest_peak_mm * farthest_peak_mm) {
      return {};
    }
    const double turn_rad = moved_mm->z / spin_mm;
    // A small body turns far within a millimetre.
    if (std::abs(turn_rad) > farthest_rad) {
      return {};
    }
    const glm::dvec3 step(glm::dvec2(*moved_mm) - swing_mm(turn_rad), turn_rad);
    glm::dvec3 peak = mean;
    for (int i = 0; i < 3; ++i) {
      if (varies[i]) {
        peak[i] += step[i];
        const double at = place[i] + step[i];
        const bool around = i == 2 && lattice_.full_circle();
        if (!around && (at < axes[i]->lower || at > axes[i]->upper)) {
          return {};
        }
      }
    }
    return peak;
  }

  BinIndex moved(const BinIndex& centre, const glm::dvec3& mean) const {
    const auto index = [](int from, double offset, const Axis& axis) {
      return axis.step() > 0.0 ? from + static_cast<int>(std::lround(offset / axis.step())) : from;
    };
    BinIndex bin{.x = index(centre.x, mean.x, lattice_.x_mm),
                 .y = index(centre.y, mean.y, lattice_.y_mm),
                 .theta = index(centre.theta, mean.z, lattice_.theta_rad)};
    const int thetas = lattice_.theta_rad.count;
    bin.theta = (bin.theta % thetas + thetas) % thetas;
    return bin;
  }

  /// Of the plain pose: of the lattice's parameters, carried through translation =
  /// (x, y) - R(theta) pivot.
  std::array<double, 9> covariance(const std::vector<Sample>& samples, const glm::dvec3& mean,
                                   double theta_rad) const {
    const double top = largest(samples);
    glm::dmat3 moment{0.0};
    double total = 0.0;
    for (const Sample& sample : samples) {
      const double weight = std::exp(sample.log_likelihood - top);
      const glm::dvec3 d = sample.offset - mean;
      moment += weight * glm::outerProduct(d, d);
      total += weight;
    }
    moment /= total;
    // A bin stands for all of its poses.
    const glm::dvec3 step = steps();
    for (int i = 0; i < 3; ++i) {
      moment[i][i] += step[i] * step[i] / 12.0;
    }
    const glm::dvec2 slope =
        -rotate(theta_rad + std::numbers::pi / 2.0, lattice_.pivot_mm);  // d translation / d theta
    glm::dmat3 jacobian{1.0};
    jacobian[2] = {slope, 1.0};  // its third column
    const glm::dmat3 plain = jacobian * moment * glm::transpose(jacobian);
    std::array<double, 9> rows{};
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        // Rounding must not leave it unsymmetric.
        rows[3 * row + column] = (plain[column][row] + plain[row][column]) / 2.0;
      }
    }
    return rows;
  }

  const DenseBelief& belief_;
  const PoseLattice& lattice_;
  std::size_t object_;
  const Body& body_;
};

}  // namespace

Body displaced_body(const OccupancyGrid& map) {
  if (std::any_of(map.log_odds.begin(), map.log_odds.end(), [](float l) { return l > 0.0F; })) {
    return body_of(map);
  }
  const double cell2 = map.cell_mm * map.cell_mm;
  return {.centroid_mm = map.origin_mm + map.cell_mm * glm::dvec2(map.nx - 1, map.ny - 1) / 2.0,
          .inertia_mm2 =
              cell2 *
              (static_cast<double>(map.nx) * map.nx + static_cast<double>(map.ny) * map.ny) / 12.0};
}

RefinedPose refine(const DenseBelief& belief, const PoseLattice& lattice, std::size_t object,
                   const Body& body, std::int64_t bin) {
  return Refinement(belief, lattice, object, body).around(bin);
}

}  // namespace palpate
