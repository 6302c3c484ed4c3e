#include "recognition/belief_modes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <unordered_map>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

namespace palpate {

namespace {

constexpr double cell_mm = 1.0;
constexpr double saddle_nats = 1.0;   ///< a peak's least height above the saddle to a higher one
constexpr double foot_nats = 7.0;     ///< how far below its peak a mode reaches
constexpr double least_share = 1e-4;  ///< of a mode; peaks of less are not compared
constexpr std::int64_t most_cells = std::int64_t{1} << 22;
constexpr double circle_rad = 2.0 * std::numbers::pi;

double spin_mm(const Body& body) { return std::sqrt(std::max(body.inertia_mm2, 1e-12)); }

/// Indices along x, y and theta.
using Index = std::array<int, 3>;

std::array<const Axis*, 3> axes_of(const PoseLattice& lattice) {
  return {&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad};
}

Index index_of(const PoseLattice& lattice, std::int64_t bin) {
  const auto in_plane = static_cast<int>(bin % lattice.plane());
  return {in_plane % lattice.x_mm.count, in_plane / lattice.x_mm.count,
          static_cast<int>(bin / lattice.plane())};
}

/// The body at poses of a lattice, in the robot frame.
class PlacedBody {
 public:
  struct Place {
    glm::dvec2 centroid_mm{0.0};
    double theta_rad = 0.0;  ///< of T_robot_object, of any number of turns
  };

  explicit PlacedBody(const BinnedObject& of) : of_(of) {}

  Place at(const Pose& T_object_robot) const {
    return {inverse(T_object_robot) * of_.body.centroid_mm, -T_object_robot.theta_rad};
  }
  Place at(double x_mm, double y_mm, double theta_rad) {
    if (theta_rad != theta_rad_) {  // bins mostly come theta by theta
      theta_rad_ = theta_rad;
      cos_ = std::cos(theta_rad);
      sin_ = std::sin(theta_rad);
    }
    const glm::dvec2 d = of_.body.centroid_mm - glm::dvec2(x_mm, y_mm);
    return {of_.lattice.pivot_mm + glm::dvec2(cos_ * d.x + sin_ * d.y, cos_ * d.y - sin_ * d.x),
            -theta_rad};
  }
  Place at(const Index& bin) {
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
    return {place.centroid_mm - rotate(theta_rad, of_.body.centroid_mm), theta_rad};
  }

 private:
  const BinnedObject& of_;
  double theta_rad_ = std::numeric_limits<double>::quiet_NaN();
  double cos_ = 1.0;
  double sin_ = 0.0;
};

/// The lattice in cells of some bins each, as far as bins reach.
class Cells {
 public:
  static constexpr int outside = -2;  ///< label of a cell of no mode
  static constexpr int unseen = -1;

  Cells(const BinnedObject& of, std::span<const BinShare> bins) : lattice_(of.lattice) {
    const std::array width{cell_mm, cell_mm, cell_mm / spin_mm(of.body)};
    Index low = {lattice_.x_mm.count, lattice_.y_mm.count, lattice_.theta_rad.count};
    Index high = {0, 0, 0};
    for (const BinShare& bin : bins) {
      const Index at = index_of(lattice_, bin.bin);
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], at[i]);
        high[i] = std::max(high[i], at[i]);
      }
    }
    if (lattice_.full_circle()) {
      low[2] = 0;
      high[2] = lattice_.theta_rad.count - 1;
    }
    for (double wider = 1.0;; wider *= 2.0) {
      for (int i = 0; i < 3; ++i) {
        const Axis& axis = *axes_of(lattice_)[i];
        const double bins_wide = axis.step() > 0.0 ? wider * width[i] / axis.step() : 1.0;
        every_[i] = static_cast<int>(std::lround(std::clamp(bins_wide, 1.0, 1.0 * axis.count)));
        first_[i] = low[i] / every_[i];
        count_[i] = high[i] / every_[i] - first_[i] + 1;
      }
      if (std::int64_t{count_[0]} * count_[1] * count_[2] <= most_cells) {
        break;
      }
    }
    density_.resize(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2]);
    for (const BinShare& bin : bins) {
      density_[cell_of(bin.bin)] += bin.share;
    }
    for (std::size_t cell = 0; cell < density_.size(); ++cell) {
      if (density_[cell] > 0.0) {
        density_[cell] /= bins_in(cell);
        seen_.push_back(cell);
      }
    }
    label_.resize(density_.size(), unseen);
  }

  std::size_t cell_of(std::int64_t bin) const {
    const Index at = index_of(lattice_, bin);
    std::size_t cell = 0;
    for (const int i : {2, 1, 0}) {
      cell = cell * count_[i] + (at[i] / every_[i] - first_[i]);
    }
    return cell;
  }

  /// Labels every cell with the peak that it belongs to; peaks are counted from 0.
  void climb() {
    std::ranges::sort(seen_, [&](std::size_t a, std::size_t b) {
      return density_[a] != density_[b] ? density_[a] > density_[b] : a < b;
    });
    std::array<std::size_t, 26> denser{};
    for (const std::size_t cell : seen_) {
      const std::span near(denser.data(), neighbours(cell, denser));
      if (near.empty()) {
        label_[cell] = static_cast<int>(peaks_.size());
        peaks_.push_back({density_[cell], label_[cell]});
        continue;
      }
      const std::size_t up = *std::ranges::max_element(
          near, [&](std::size_t a, std::size_t b) { return density_[a] < density_[b]; });
      label_[cell] = label_[up] == outside ? outside : root(label_[up]);
      if (label_[cell] == outside ||
          density_[cell] < peaks_[label_[cell]].density * std::exp(-foot_nats)) {
        label_[cell] = outside;
        continue;
      }
      for (const std::size_t other : near) {
        if (label_[other] != outside) {
          join(root(label_[cell]), root(label_[other]), density_[cell]);
        }
      }
    }
  }

  /// The peak of a bin's cell, after climb(); none where the cell is of no mode.
  std::optional<int> peak_of(std::int64_t bin) {
    const int label = label_[cell_of(bin)];
    return label == outside ? std::nullopt : std::optional(root(label));
  }

 private:
  struct Peak {
    double density = 0.0;
    int parent = 0;  ///< the higher peak that this one is part of, or itself
  };

  /// The number of bins that a cell holds: fewer at the end of an axis.
  double bins_in(std::size_t cell) const {
    double bins = 1.0;
    for (int i = 0; i < 3; ++i) {
      const int at = static_cast<int>(cell % count_[i]) + first_[i];
      bins *= std::min(every_[i], axes_of(lattice_)[i]->count - at * every_[i]);
      cell /= count_[i];
    }
    return bins;
  }

  /// Writes the neighbours that have a label; returns how many there are.
  std::size_t neighbours(std::size_t cell, std::array<std::size_t, 26>& near) const {
    Index at{};
    for (int i = 0; i < 3; ++i) {
      at[i] = static_cast<int>(cell % count_[i]);
      cell /= count_[i];
    }
    std::size_t n = 0;
    for (int dt = -1; dt <= 1; ++dt) {
      int theta = at[2] + dt;
      if (lattice_.full_circle()) {
        theta = (theta + count_[2]) % count_[2];
      }
      for (int y = std::max(at[1] - 1, 0); y <= std::min(at[1] + 1, count_[1] - 1); ++y) {
        for (int x = std::max(at[0] - 1, 0); x <= std::min(at[0] + 1, count_[0] - 1); ++x) {
          const bool same = x == at[0] && y == at[1] && theta == at[2];
          if (theta < 0 || theta >= count_[2] || same) {
            continue;
          }
          const std::size_t other =
              (static_cast<std::size_t>(theta) * count_[1] + y) * count_[0] + x;
          if (label_[other] != unseen) {
            near[n++] = other;
          }
        }
      }
    }
    return n;
  }

  int root(int peak) {
    while (peaks_[peak].parent != peak) {
      peak = peaks_[peak].parent = peaks_[peaks_[peak].parent].parent;
    }
    return peak;
  }

  /// Makes the lower of two peaks part of the higher where it hardly stands above their saddle.
  void join(int a, int b, double saddle) {
    const int low = peaks_[a].density < peaks_[b].density ? a : b;
    const int high = low == a ? b : a;
    if (low != high && peaks_[low].density * std::exp(-saddle_nats) < saddle) {
      peaks_[low].parent = high;
    }
  }

  const PoseLattice& lattice_;
  Index every_{};  ///< bins of a cell
  Index first_{};  ///< cell
  Index count_{};
  std::vector<double> density_;    ///< [theta, y, x] mean share of a cell's bins
  std::vector<std::size_t> seen_;  ///< cells that have bins
  std::vector<int> label_;
  std::vector<Peak> peaks_;
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
  glm::dmat3 variance{0.0};
  for (int i = 0; i < 3; ++i) {
    const double step = axes_of(lattice)[i]->step();
    variance[i][i] = step * step / 12.0;
  }
  return jacobian * variance * glm::transpose(jacobian);
}

ObjectPose pose_of(const Moments& moments, const PlacedBody& body, const BinnedObject& of) {
  const glm::dvec3 mean = moments.sum / moments.share;
  const Pose best = body.T_robot_object(moments.best, moments.best);
  RefinedPose at{{best.translation_mm + glm::dvec2(mean), best.theta_rad + mean.z}, {}};
  const glm::dmat3 covariance = moments.squares / moments.share - glm::outerProduct(mean, mean) +
                                spread_in_bin(of.lattice, at.T_object_robot);
  for (int i = 0; i < 9; ++i) {
    at.covariance[i] = (covariance[i % 3][i / 3] + covariance[i / 3][i % 3]) / 2.0;
  }
  // The inverse of the inverse: least_turned() is of T_object_robot.
  const ObjectPose inverted = inverse(at);
  return inverse(
      least_turned(of.body, of.symmetry, {inverted.T_robot_object, inverted.covariance}));
}

/// The bins' peaks, each with its best bin and share, those of equal places made one: [peak] the
/// mode that it is of, or none.
std::unordered_map<int, std::size_t> join_near(const std::unordered_map<int, Moments>& peaks,
                                               const PlacedBody& body,
                                               std::vector<Moments>& modes) {
  std::vector<int> order;
  for (const auto& [peak, moments] : peaks) {
    if (moments.share >= least_share) {
      order.push_back(peak);
    }
  }
  std::ranges::sort(order, [&](int a, int b) {
    const double of_a = peaks.at(a).best_share;
    const double of_b = peaks.at(b).best_share;
    return of_a != of_b ? of_a > of_b : a < b;
  });
  std::unordered_map<int, std::size_t> mode_of;
  for (const int peak : order) {
    const auto near = std::ranges::find_if(modes, [&](const Moments& mode) {
      return body.apart_mm(mode.best, peaks.at(peak).best) <= neighbourhood_mm;
    });
    mode_of[peak] = static_cast<std::size_t>(near - modes.begin());
    if (near == modes.end()) {
      modes.push_back({.best = peaks.at(peak).best, .best_bin = peaks.at(peak).best_bin});
    }
  }
  return mode_of;
}

}  // namespace

std::vector<BeliefMode> find_modes(const BinnedObject& of, std::span<const BinShare> bins) {
  if (bins.empty()) {
    return {};
  }
  Cells cells(of, bins);
  cells.climb();
  PlacedBody body(of);
  std::unordered_map<int, Moments> peaks;
  std::vector<std::optional<int>> peak_of;
  for (const BinShare& bin : bins) {
    peak_of.push_back(cells.peak_of(bin.bin));
    if (peak_of.back()) {
      Moments& peak = peaks[*peak_of.back()];
      peak.share += bin.share;
      if (bin.share > peak.best_share) {
        peak.best_share = bin.share;
        peak.best_bin = bin.bin;
        peak.best = body.at(index_of(of.lattice, bin.bin));
      }
    }
  }
  std::vector<Moments> moments;
  const auto mode_of = join_near(peaks, body, moments);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const auto mode = peak_of[i] ? mode_of.find(*peak_of[i]) : mode_of.end();
    if (mode == mode_of.end()) {
      continue;
    }
    Moments& sums = moments[mode->second];
    const Pose best = body.T_robot_object(sums.best, sums.best);
    const Pose T_robot_object =
        body.T_robot_object(body.at(index_of(of.lattice, bins[i].bin)), sums.best);
    const glm::dvec3 d(T_robot_object.translation_mm - best.translation_mm,
                       T_robot_object.theta_rad - best.theta_rad);
    sums.share += bins[i].share;
    sums.sum += bins[i].share * d;
    sums.squares += bins[i].share * glm::outerProduct(d, d);
  }
  std::vector<BeliefMode> modes;
  for (const Moments& sums : moments) {
    modes.push_back({.probability = sums.share,
                     .best = of.lattice.T_object_robot(sums.best_bin),
                     .pose = pose_of(sums, body, of)});
  }
  return modes;
}

std::vector<PartAway> parts_away(const BinnedObject& of, std::span<const BinShare> bins,
                                 const Pose& T_object_robot) {
  constexpr double near_in_bins = 5.0;
  constexpr std::array thirds{-1.0 / 3.0, 0.0, 1.0 / 3.0};
  const glm::dvec3 step(of.lattice.x_mm.step(), of.lattice.y_mm.step(),
                        of.lattice.theta_rad.step());
  const double bin_mm = glm::length(step * glm::dvec3(1.0, 1.0, spin_mm(of.body)));
  PlacedBody body(of);
  const PlacedBody::Place from = body.at(T_object_robot);
  std::vector<PartAway> parts;
  parts.reserve(bins.size());
  for (const BinShare& bin : bins) {
    const Index at = index_of(of.lattice, bin.bin);
    const double mm = body.apart_mm(from, body.at(at));
    if (mm > near_in_bins * bin_mm) {
      parts.push_back({mm, bin.share});
      continue;
    }
    const glm::dvec3 centre(of.lattice.x_mm.centre(at[0]), of.lattice.y_mm.centre(at[1]),
                            of.lattice.theta_rad.centre(at[2]));
    for (const double theta : thirds) {
      for (const double y : thirds) {
        for (const double x : thirds) {
          const glm::dvec3 part = centre + step * glm::dvec3(x, y, theta);
          parts.push_back({body.apart_mm(from, body.at(part.x, part.y, part.z)), bin.share / 27.0});
        }
      }
    }
  }
  std::ranges::sort(parts, {}, &PartAway::mm);
  return parts;
}

double share_within(std::span<const PartAway> parts, double mm) {
  double share = 0.0;
  for (auto part = parts.begin(); part != parts.end() && part->mm <= mm; ++part) {
    share += part->share;
  }
  return share;
}

}  // namespace palpate
