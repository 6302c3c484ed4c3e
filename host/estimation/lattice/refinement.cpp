#include "estimation/lattice/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "model/body_spread.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// docs/refinement.md holds the measurements behind these constants.
constexpr double least_root = 8.0;  ///< n of the weights belief^(1/n)
constexpr double radius_mm = 2.5;   ///< of the window
constexpr int passes = 3;           ///< windows at most, the first around the given bin
// The quadratic's weights: a root three times as high, times a Gaussian about the mean.
constexpr double peak_root_factor = 3.0;
constexpr double peak_sd_mm = 0.8;
constexpr double farthest_peak_mm = 1.0;  ///< from the mean; farther peaks are of poor fits
/// In nats per mm^2: rounding of the log-likelihoods, 1e-3 nats after a thousand touches, makes as
/// much.
constexpr double least_curvature = 1e-3;

/// The mode's bin, or the bin of its pose.
BinIndex bin_of(const PoseLattice& lattice, const Mode& mode) {
  const std::int64_t bin = mode.bin ? *mode.bin : lattice.bin_of(mode.T_object_robot);
  static_cast<void>(lattice.T_object_robot(bin));  // throws where there is no such bin
  return {.x = static_cast<int>(bin % lattice.x_mm.count),
          .y = static_cast<int>(bin % lattice.plane() / lattice.x_mm.count),
          .theta = static_cast<int>(bin / lattice.plane())};
}

/// The bin at an offset in (x_mm, y_mm, theta_rad) from the centre of another.
BinIndex bin_at(const PoseLattice& lattice, const BinIndex& from, const glm::dvec3& offset) {
  const auto index = [](int start, double distance, const Axis& axis) {
    return axis.step() > 0.0 ? start + static_cast<int>(std::lround(distance / axis.step()))
                             : start;
  };
  const int thetas = lattice.theta_rad.count;
  return {.x = index(from.x, offset.x, lattice.x_mm),
          .y = index(from.y, offset.y, lattice.y_mm),
          .theta = (index(from.theta, offset.z, lattice.theta_rad) % thetas + thetas) % thetas};
}

/// Mean offset from the centre bin under weights belief^(1/root).
glm::dvec3 weighted_mean(const BodyWindow& window, double root) {
  glm::dvec3 sum{0.0};
  double total = 0.0;
  for (const BodyWindow::Bin& bin : window.bins) {
    const double weight = std::exp((bin.log_likelihood - window.largest) / root);
    sum += weight * bin.offset;
    total += weight;
  }
  return sum / total;
}

/// A value at a place, and its weight in the fit.
struct WeightedValue {
  glm::dvec3 at{0.0};
  double value = 0.0;
  double weight = 0.0;
};

/// The maximum of a quadratic.
struct Peak {
  glm::dvec3 at{0.0};
  /// Inverse of minus the second derivatives: of the log of a density, its covariance.
  glm::dmat3 covariance{0.0};
};

/// Solves matrix x = right in place, for a symmetric matrix, [n, n]. Returns false where the matrix
/// is not positive definite within rounding.
bool solve(std::vector<double> matrix, std::vector<double>& right) {
  constexpr double rounding = 1e-9;
  const std::size_t n = right.size();
  std::vector<double> least;
  for (std::size_t i = 0; i < n; ++i) {
    least.push_back(rounding * matrix[i * n + i]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double pivot = matrix[i * n + i];
    if (!(pivot > 0.0 && pivot > least[i])) {
      return false;
    }
    for (std::size_t row = i + 1; row < n; ++row) {
      const double factor = matrix[row * n + i] / pivot;
      for (std::size_t column = i; column < n; ++column) {
        matrix[row * n + column] -= factor * matrix[i * n + column];
      }
      right[row] -= factor * right[i];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t column = i + 1; column < n; ++column) {
      right[i] -= matrix[i * n + column] * right[column];
    }
    right[i] /= matrix[i * n + i];
  }
  return true;
}

/// The maximum of the quadratic that fits the values in weighted least squares. Coordinates that do
/// not vary stay at 0, without variance. Returns nothing where there are fewer than two values per
/// coefficient, too few different places, or no maximum of at least `least_curvature`.
std::optional<Peak> quadratic_peak(std::span<const WeightedValue> values,
                                   const std::array<bool, 3>& varies) {
  std::vector<int> axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (varies[axis]) {
      axes.push_back(axis);
    }
  }
  const std::size_t d = axes.size();
  const std::size_t unknowns = 1 + d + d * (d + 1) / 2;
  if (d == 0 || values.size() < 2 * unknowns) {
    return {};
  }
  // The normal equations in 1, the coordinates, and their products.
  std::vector<double> matrix(unknowns * unknowns);
  std::vector<double> fit(unknowns);
  std::vector<double> terms(unknowns);
  for (const WeightedValue& value : values) {
    std::size_t k = 0;
    terms[k++] = 1.0;
    for (const int axis : axes) {
      terms[k++] = value.at[axis];
    }
    for (std::size_t a = 0; a < d; ++a) {
      for (std::size_t b = a; b < d; ++b) {
        terms[k++] = value.at[axes[a]] * value.at[axes[b]];
      }
    }
    for (std::size_t row = 0; row < unknowns; ++row) {
      for (std::size_t column = 0; column < unknowns; ++column) {
        matrix[row * unknowns + column] += value.weight * terms[row] * terms[column];
      }
      fit[row] += value.weight * terms[row] * value.value;
    }
  }
  if (!solve(std::move(matrix), fit)) {
    return {};
  }
  // The slope vanishes where -(second derivatives) x = slope at 0.
  std::vector<double> curvature(d * d);
  std::vector<double> peak(fit.begin() + 1, fit.begin() + 1 + static_cast<std::ptrdiff_t>(d));
  std::size_t k = 1 + d;
  for (std::size_t a = 0; a < d; ++a) {
    for (std::size_t b = a; b < d; ++b, ++k) {
      curvature[a * d + b] -= fit[k];
      curvature[b * d + a] -= fit[k];
    }
    if (!(curvature[a * d + a] > least_curvature)) {
      return {};
    }
  }
  if (!solve(curvature, peak)) {
    return {};
  }
  Peak result;
  for (std::size_t a = 0; a < d; ++a) {
    result.at[axes[a]] = peak[a];
    std::vector<double> column(d);
    column[a] = 1.0;
    solve(curvature, column);
    for (std::size_t b = 0; b < d; ++b) {
      result.covariance[axes[a]][axes[b]] = column[b];
    }
  }
  return result;
}

/// Peak of the quadratic in the body's motion that fits the log-belief around the mean, in (x_mm,
/// y_mm, theta_rad) from the centre bin. Nothing where the fit has no peak nearby and within the
/// region.
std::optional<Peak> peak_near(const BodyWindow& window, const PoseLattice& lattice,
                              const Body& body, const glm::dvec3& mean, double root) {
  const BodyMotion motion(body, window.centre + mean);
  std::vector<WeightedValue> values;
  double farthest_rad = 0.0;
  for (const BodyWindow::Bin& bin : window.bins) {
    if (!bin.within_radius) {
      continue;
    }
    const glm::dvec3 change = bin.offset - mean;
    farthest_rad = std::max(farthest_rad, std::abs(change.z));
    const glm::dvec3 moved_mm = motion.by(change);
    const double below = bin.log_likelihood - window.largest;
    const double log_weight = below / (peak_root_factor * root) -
                              glm::dot(moved_mm, moved_mm) / (2.0 * peak_sd_mm * peak_sd_mm);
    values.push_back({moved_mm, below, std::exp(log_weight)});
  }
  const std::array<const Axis*, 3> axes{&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad};
  const std::array varies{axes[0]->count > 1, axes[1]->count > 1, axes[2]->count > 1};
  const std::optional<Peak> fitted = quadratic_peak(values, varies);
  if (!fitted || glm::dot(fitted->at, fitted->at) > farthest_peak_mm * farthest_peak_mm) {
    return {};
  }
  const glm::dvec3 change = motion.change_for(fitted->at);
  // A small body turns far within a millimetre.
  if (std::abs(change.z) > farthest_rad) {
    return {};
  }
  Peak peak{.at = mean};
  glm::dmat3 slope{0.0};  // of the change in the motion, by columns
  for (int i = 0; i < 3; ++i) {
    if (varies[i]) {
      peak.at[i] += change[i];
      const double at = window.centre[i] + mean[i] + change[i];
      const bool around = i == 2 && lattice.full_circle();
      if (!around && (at < axes[i]->lower || at > axes[i]->upper)) {
        return {};
      }
      constexpr double little_mm = 1e-4;
      glm::dvec3 moved_mm{0.0};
      moved_mm[i] = little_mm;
      slope[i] = motion.change_for(moved_mm) / little_mm;
    }
  }
  for (int i = 0; i < 3; ++i) {  // a turn's lever is nothing to an axis that is fixed
    for (int k = 0; k < 3 && !varies[i]; ++k) {
      slope[k][i] = 0.0;
    }
  }
  peak.covariance = slope * fitted->covariance * glm::transpose(slope);
  return peak;
}

/// Second moment of the belief about an offset from the centre bin, in (x_mm, y_mm, theta_rad).
glm::dmat3 second_moment(const BodyWindow& window, const PoseLattice& lattice,
                         const glm::dvec3& about) {
  glm::dmat3 moment{0.0};
  double total = 0.0;
  for (const BodyWindow::Bin& bin : window.bins) {
    const double weight = std::exp(bin.log_likelihood - window.largest);
    const glm::dvec3 d = bin.offset - about;
    moment += weight * glm::outerProduct(d, d);
    total += weight;
  }
  moment /= total;
  // A bin stands for all of its poses.
  const glm::dvec3 step(lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step());
  for (int i = 0; i < 3; ++i) {
    moment[i][i] += step[i] * step[i] / 12.0;
  }
  return moment;
}

/// Covariance of T_object_robot, whose translation is (x, y) - R(theta) pivot.
std::array<double, 9> pose_covariance(const glm::dmat3& moment, const PoseLattice& lattice,
                                      double theta_rad) {
  const glm::dvec2 slope =
      -rotate(theta_rad + std::numbers::pi / 2.0, lattice.pivot_mm);  // d translation / d theta
  glm::dmat3 jacobian{1.0};
  jacobian[2] = {slope, 1.0};  // the third column
  return carried_over(moment, jacobian);
}

double on_circle(const Axis& theta, double theta_rad) {
  const double period_rad = theta.upper - theta.lower;
  return theta_rad - period_rad * std::floor((theta_rad - theta.lower) / period_rad);
}

/// The bins within the window's radius.
std::vector<BodyWindow::Bin> within_radius(const BodyWindow& window) {
  std::vector<BodyWindow::Bin> bins;
  std::ranges::copy_if(window.bins, std::back_inserter(bins), &BodyWindow::Bin::within_radius);
  return bins;
}

/// Root mean square distance from the mean under weights exp(log-likelihood * inverse_root).
double spread_mm(std::span<const BodyWindow::Bin> bins, double top, double inverse_root) {
  glm::dvec3 sum{0.0};
  double squares = 0.0;
  double total = 0.0;
  for (const BodyWindow::Bin& bin : bins) {
    const double weight = std::exp((bin.log_likelihood - top) * inverse_root);
    sum += weight * bin.moved_mm;
    squares += weight * glm::dot(bin.moved_mm, bin.moved_mm);
    total += weight;
  }
  sum /= total;
  return std::sqrt(std::max(0.0, squares / total - glm::dot(sum, sum)));
}

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

RefinedPose refine(const BoxLogLikelihood& log_likelihood, const PoseLattice& lattice,
                   const Body& body, const Mode& mode) {
  BodyWindow window;
  double root = 0.0;
  glm::dvec3 mean{0.0};
  BinIndex centre = bin_of(lattice, mode);
  for (int pass = 1; pass <= passes; ++pass) {
    window = body_window(log_likelihood, lattice, mode.object, body, centre, radius_mm);
    root = flattening_root(within_radius(window), least_root);
    mean = weighted_mean(window, root);
    const BinIndex nearest = bin_at(lattice, centre, mean);
    if (nearest == centre) {
      break;
    }
    centre = nearest;
  }
  Peak peak = peak_near(window, lattice, body, mean, root).value_or(Peak{.at = mean});
  // The quadratic's weights reach so far: what spreads more has another shape there.
  if (peak.covariance == glm::dmat3(0.0) ||
      spread_mm(within_radius(window), window.largest, 1.0) > peak_sd_mm) {
    peak.covariance = second_moment(window, lattice, peak.at);
  }
  glm::dvec3 place = window.centre + peak.at;
  if (lattice.full_circle()) {
    place.z = on_circle(lattice.theta_rad, place.z);
  }
  return {.T_object_robot = lattice.T_object_robot(place.x, place.y, place.z),
          .covariance = pose_covariance(peak.covariance, lattice, place.z)};
}

PoseLattice thinned(PoseLattice lattice) {
  constexpr double fine_mm = 0.1;
  constexpr int least_bins = 3;  // of fewer, the middle ones say little of a narrow region's ends
  for (Axis* axis : {&lattice.x_mm, &lattice.y_mm}) {
    const double step = axis->step();
    const int widest = axis->count / least_bins;
    const double wanted = std::min<double>(fine_mm / step, widest);
    // An odd number, so that the middle one is a centre.
    const int every = static_cast<int>((wanted - 1.0) / 2.0) * 2 + 1;
    if (every > 1) {
      axis->count /= every;
      axis->upper = axis->lower + axis->count * every * step;
    }
  }
  return lattice;
}

double flattening_root(std::span<const BodyWindow::Bin> bins, double least) {
  // A larger share suits coarse bins after many touches, a smaller share fine bins after few.
  constexpr double wanted_share = 1.0 / 3.0;
  // To an n of 1e20. Where bins differ by more nats, one bin has all the weight whatever the n.
  constexpr int most_doublings = 64;
  const double top = std::ranges::max(bins, {}, &BodyWindow::Bin::log_likelihood).log_likelihood;
  const double wanted_mm = wanted_share * spread_mm(bins, top, 0.0);
  double root = least;
  double narrow_mm = spread_mm(bins, top, 1.0 / root);
  for (int i = 0; i < most_doublings && narrow_mm < wanted_mm; ++i) {
    const double wide_mm = spread_mm(bins, top, 0.5 / root);
    if (wide_mm >= wanted_mm) {
      // Interpolated, so that the root follows the belief without steps.
      return root * std::exp2((wanted_mm - narrow_mm) / (wide_mm - narrow_mm));
    }
    root *= 2.0;
    narrow_mm = wide_mm;
  }
  return root;
}

}  // namespace palpate
