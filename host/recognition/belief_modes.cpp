#include "recognition/belief_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "model/body_spread.hpp"
#include "model/displacement_points.hpp"
#include "recognition/belief_cells.hpp"

namespace palpate {

namespace {

constexpr double least_share = 1e-4;  ///< of a mode; peaks of less are not compared
constexpr double circle_rad = 2.0 * std::numbers::pi;

glm::dvec3 step_of(const PoseLattice& lattice) {
  return {lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step()};
}

/// The body at poses of a lattice, in the robot frame.
class PlacedBody {
 public:
  struct Place {
    glm::dvec2 centroid_mm{0.0};
    glm::dvec2 origin_mm{0.0};  ///< of the object frame
    double theta_rad = 0.0;     ///< of T_robot_object, of any number of turns
  };

  explicit PlacedBody(const BinnedObject& of) : of_(of) {}

  Place at(const Pose& T_object_robot) const {
    const Pose T_robot_object = inverse(T_object_robot);
    return {T_robot_object * of_.body.centroid_mm, T_robot_object.translation_mm,
            T_robot_object.theta_rad};
  }
  Place at(double x_mm, double y_mm, double theta_rad) {
    if (theta_rad != theta_rad_) {  // bins mostly come theta by theta
      theta_rad_ = theta_rad;
      cos_ = std::cos(theta_rad);
      sin_ = std::sin(theta_rad);
    }
    const auto turned_back = [&](const glm::dvec2& v) {
      return glm::dvec2(cos_ * v.x + sin_ * v.y, cos_ * v.y - sin_ * v.x);
    };
    const glm::dvec2 origin_mm = of_.lattice.pivot_mm - turned_back({x_mm, y_mm});
    return {origin_mm + turned_back(of_.body.centroid_mm), origin_mm, -theta_rad};
  }
  Place at(const AxisIndices& bin) {
    return at(of_.lattice.x_mm.centre(bin[0]), of_.lattice.y_mm.centre(bin[1]),
              of_.lattice.theta_rad.centre(bin[2]));
  }

  /// By how much the second is turned from the first, but for equal turns.
  double turn_rad(const Place& from, const Place& to) const {
    return of_.symmetry == 0 ? 0.0
                             : wrap_angle(to.theta_rad - from.theta_rad, circle_rad / of_.symmetry);
  }
  /// pose_error_mm()
  double apart_mm(const Place& a, const Place& b) const {
    const glm::dvec2 shift = b.centroid_mm - a.centroid_mm;
    const double s = of_.symmetry == 1 ? std::sin((b.theta_rad - a.theta_rad) / 2.0)
                                       : std::sin(turn_rad(a, b) / 2.0);
    return std::sqrt(glm::dot(shift, shift) + 4.0 * of_.body.inertia_mm2 * s * s);
  }
  /// T_robot_object with the body at the place, of equal turns the nearest to `like`; theta is
  /// within half a turn of its.
  Pose T_robot_object(const Place& place, const Place& like) const {
    const double theta_rad = like.theta_rad + turn_rad(like, place);
    return {of_.symmetry == 1 ? place.origin_mm
                              : place.centroid_mm - rotate(theta_rad, of_.body.centroid_mm),
            theta_rad};
  }

 private:
  const BinnedObject& of_;
  double theta_rad_ = std::numeric_limits<double>::quiet_NaN();
  double cos_ = 1.0;
  double sin_ = 0.0;
};

/// Sums over the bins of a mode, of T_robot_object less that of its best bin.
struct Moments {
  PlacedBody::Place best;
  std::int64_t best_bin = 0;
  double best_share = 0.0;
  double share = 0.0;
  glm::dvec3 sum{0.0};
  glm::dmat3 squares{0.0};
};

/// What the spread of a bin adds: its poses are uniform in x, y and theta of the lattice.
glm::dmat3 spread_in_bin(const PoseLattice& lattice, const Pose& T_robot_object) {
  // t = pivot - R(theta) (x, y), where theta is that of T_robot_object.
  const double theta_rad = T_robot_object.theta_rad;
  const glm::dvec2 lever = T_robot_object.translation_mm - lattice.pivot_mm;
  glm::dmat3 jacobian{0.0};  // by columns
  jacobian[0] = {-rotate(theta_rad, {1.0, 0.0}), 0.0};
  jacobian[1] = {-rotate(theta_rad, {0.0, 1.0}), 0.0};
  jacobian[2] = {-lever.y, lever.x, 1.0};
  const glm::dvec3 step = step_of(lattice);
  glm::dmat3 variance{0.0};
  for (int i = 0; i < 3; ++i) {
    variance[i][i] = step[i] * step[i] / 12.0;
  }
  return jacobian * variance * glm::transpose(jacobian);
}

ObjectPose pose_of(const Moments& moments, const BinnedObject& of) {
  const glm::dvec3 mean = moments.sum / moments.share;
  RefinedPose at{{moments.best.origin_mm + glm::dvec2(mean), moments.best.theta_rad + mean.z}, {}};
  const glm::dmat3 covariance = moments.squares / moments.share - glm::outerProduct(mean, mean) +
                                spread_in_bin(of.lattice, at.T_object_robot);
  for (int i = 0; i < 9; ++i) {
    at.covariance[i] = (covariance[i % 3][i / 3] + covariance[i / 3][i % 3]) / 2.0;
  }
  // The inverse of the inverse: least_turned() is of T_object_robot.
  const ObjectPose inverted = inverse(at);
  ObjectPose pose =
      inverse(least_turned(of.body, of.symmetry, {inverted.T_robot_object, inverted.covariance}));
  pose.T_robot_object.theta_rad = wrap_angle(pose.T_robot_object.theta_rad, circle_rad);
  return pose;
}

/// The lower triangle L of L L^T, for a covariance; axes without variance have none.
glm::dmat3 cholesky(const glm::dmat3& covariance) {
  glm::dmat3 lower{0.0};  // by columns
  for (int j = 0; j < 3; ++j) {
    for (int i = j; i < 3; ++i) {
      double rest = covariance[j][i];
      for (int k = 0; k < j; ++k) {
        rest -= lower[k][i] * lower[k][j];
      }
      if (i == j) {
        lower[j][j] = std::sqrt(std::max(rest, 0.0));
      } else {
        lower[j][i] = lower[j][j] > 0.0 ? rest / lower[j][j] : 0.0;
      }
    }
  }
  return lower;
}

/// Makes modes of the peaks; a peak near a higher one is of that one's mode. Their sums are empty.
/// @param peaks each with its best bin and share
/// @param mode_of [peak] receives the mode that each peak is of; stays where it is of none
std::vector<Moments> modes_of(std::span<const Moments> peaks, const PlacedBody& body,
                              std::vector<std::size_t>& mode_of) {
  std::vector<std::size_t> order;
  for (std::size_t peak = 0; peak < peaks.size(); ++peak) {
    if (peaks[peak].share >= least_share) {
      order.push_back(peak);
    }
  }
  std::ranges::stable_sort(order, std::greater<>(),
                           [&](std::size_t peak) { return peaks[peak].best_share; });
  std::vector<Moments> modes;
  for (const std::size_t peak : order) {
    const auto near = std::ranges::find_if(modes, [&](const Moments& mode) {
      return body.apart_mm(mode.best, peaks[peak].best) <= neighbourhood_mm;
    });
    mode_of[peak] = static_cast<std::size_t>(near - modes.begin());
    if (near == modes.end()) {
      modes.push_back({.best = peaks[peak].best, .best_bin = peaks[peak].best_bin});
    }
  }
  return modes;
}

}  // namespace

FoundModes find_modes(const BinnedObject& of, std::span<const BinShare> bins) {
  if (bins.empty()) {
    return {};
  }
  std::vector<AxisIndices> at;
  at.reserve(bins.size());
  for (const BinShare& bin : bins) {
    at.push_back(indices_of(of.lattice, bin.bin));
  }
  const BeliefPeaks of_cells = peaks_of(of, bins, at);
  PlacedBody body(of);
  std::vector<Moments> peaks(of_cells.count);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const int peak = of_cells.of_bin[i];
    if (peak == BeliefPeaks::outside) {
      continue;
    }
    Moments& sums = peaks[peak];
    sums.share += bins[i].share;
    if (bins[i].share > sums.best_share) {
      sums.best_share = bins[i].share;
      sums.best_bin = bins[i].bin;
      sums.best = body.at(at[i]);
    }
  }
  std::vector<std::size_t> mode_of(peaks.size(), peaks.size());
  std::vector<Moments> moments = modes_of(peaks, body, mode_of);
  FoundModes found;
  found.mode_of.reserve(bins.size());
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const int peak = of_cells.of_bin[i];
    const bool of_none = peak == BeliefPeaks::outside || mode_of[peak] == peaks.size();
    found.mode_of.push_back(of_none ? moments.size() : mode_of[peak]);
    if (of_none) {
      continue;
    }
    Moments& sums = moments[mode_of[peak]];
    const Pose T_robot_object = body.T_robot_object(body.at(at[i]), sums.best);
    const glm::dvec3 d(T_robot_object.translation_mm - sums.best.origin_mm,
                       T_robot_object.theta_rad - sums.best.theta_rad);
    sums.share += bins[i].share;
    sums.sum += bins[i].share * d;
    sums.squares += bins[i].share * glm::outerProduct(d, d);
  }
  for (const Moments& sums : moments) {
    found.modes.push_back({.probability = sums.share,
                           .best = of.lattice.T_object_robot(sums.best_bin),
                           .pose = pose_of(sums, of)});
  }
  return found;
}

std::vector<PartAway> parts_away(const BinnedObject& of, std::span<const BinShare> bins,
                                 const Pose& T_object_robot) {
  PlacedBody body(of);
  const PlacedBody::Place from = body.at(T_object_robot);
  std::vector<PartAway> parts;
  parts.reserve(bins.size());
  for (const BinShare& bin : bins) {
    parts.push_back({body.apart_mm(from, body.at(indices_of(of.lattice, bin.bin))), bin.share});
  }
  return parts;
}

std::vector<PartAway> spread_between_bins(const BinnedObject& of, std::vector<PartAway> parts,
                                          const RefinedPose& refined) {
  constexpr std::size_t points = 512;  // standard error of a share of 95 %: below 0.01
  const double near = share_within(parts, neighbourhood_mm);
  std::erase_if(parts, [](const PartAway& part) { return part.mm <= neighbourhood_mm; });
  // About the body: the robot's origin may lie far away.
  const glm::dmat3 factor = cholesky(motion_covariance(of.body, inverse(refined)));
  PlacedBody body(of);
  const PlacedBody::Place from = body.at(refined.T_object_robot);
  static const std::vector<Pose> normals = displacement_points({.mm = 1.0, .rad = 1.0}, points);
  for (const Pose& normal : normals) {
    const glm::dvec3 off = factor * glm::dvec3(normal.translation_mm, normal.theta_rad);
    PlacedBody::Place at = from;
    at.centroid_mm += glm::dvec2(off);
    at.theta_rad += off.z / spin_mm(of.body);
    parts.push_back({body.apart_mm(from, at), near / static_cast<double>(points)});
  }
  return parts;
}

double share_within(std::span<const PartAway> parts, double mm) {
  double share = 0.0;
  for (const PartAway& part : parts) {
    share += part.mm <= mm ? part.share : 0.0;
  }
  return share;
}

std::optional<double> distance_holding(std::vector<PartAway> parts, double share) {
  if (share_within(parts, std::numeric_limits<double>::infinity()) < share) {
    return {};
  }
  std::ranges::sort(parts, {}, &PartAway::mm);
  auto part = parts.begin();
  for (double held = part->share; held < share && part + 1 != parts.end(); held += part->share) {
    ++part;
  }
  return part->mm;
}

}  // namespace palpate
