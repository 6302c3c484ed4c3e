#include "recognition/belief_cells.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/body_spread.hpp"

namespace palpate {

namespace {

constexpr double cell_mm = 1.0;
constexpr double saddle_nats = 1.0;  ///< a peak's least height above the saddle to a higher one
constexpr double foot_nats = 7.0;    ///< how far below its peak a mode reaches
constexpr std::int64_t most_kept_cells = std::int64_t{1}
                                         << 22;  ///< cells are wider where there are more
constexpr int unlabelled = -1;                   ///< label of a cell without one

constexpr int outside = BeliefPeaks::outside;

class BeliefCells {
 public:
  BeliefCells(const BinnedObject& of, std::span<const BinShare> bins,
              std::span<const AxisIndices> at)
      : lattice_(of.lattice) {
    const std::array width{cell_mm, cell_mm, cell_mm / spin_mm(of.body)};
    AxisIndices low = {lattice_.x_mm.count, lattice_.y_mm.count, lattice_.theta_rad.count};
    AxisIndices high = {0, 0, 0};
    for (const AxisIndices& bin : at) {
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], bin[i]);
        high[i] = std::max(high[i], bin[i]);
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
      if (std::int64_t{count_[0]} * count_[1] * count_[2] <= most_kept_cells) {
        break;
      }
    }
    density_.resize(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2]);
    for (std::size_t i = 0; i < bins.size(); ++i) {
      density_[cell_of(at[i])] += bins[i].share;
    }
    for (std::size_t cell = 0; cell < density_.size(); ++cell) {
      if (density_[cell] > 0.0) {
        density_[cell] /= bins_in(cell);
        seen_.push_back(cell);
      }
    }
    label_.resize(density_.size(), unlabelled);
  }

  void climb() {
    std::ranges::sort(seen_, [&](std::size_t a, std::size_t b) {
      return density_[a] != density_[b] ? density_[a] > density_[b] : a < b;
    });
    Neighbours denser{};
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

  int peak_of(const AxisIndices& bin) {
    const int label = label_[cell_of(bin)];
    return label == outside ? outside : root(label);
  }

  std::size_t peaks() const { return peaks_.size(); }

 private:
  struct Peak {
    double density = 0.0;
    int parent = 0;  ///< the higher peak that this one is part of, or itself
  };
  using Neighbours = std::array<std::size_t, 26>;

  std::size_t cell_of(const AxisIndices& at) const {
    std::size_t cell = 0;
    for (const int i : {2, 1, 0}) {
      cell = cell * count_[i] + (at[i] / every_[i] - first_[i]);
    }
    return cell;
  }
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
  std::size_t neighbours(std::size_t cell, Neighbours& near) const {
    AxisIndices at{};
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
          if (label_[other] != unlabelled) {
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
  AxisIndices every_{};  ///< bins of a cell
  AxisIndices first_{};  ///< cell
  AxisIndices count_{};
  std::vector<double> density_;    ///< [theta, y, x] mean share of a cell's bins
  std::vector<std::size_t> seen_;  ///< cells that have bins
  std::vector<int> label_;         ///< [theta, y, x] a peak, `outside`, or none yet
  std::vector<Peak> peaks_;
};

}  // namespace

std::array<const Axis*, 3> axes_of(const PoseLattice& lattice) {
  return {&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad};
}

AxisIndices indices_of(const PoseLattice& lattice, std::int64_t bin) {
  const auto in_plane = static_cast<int>(bin % lattice.plane());
  return {in_plane % lattice.x_mm.count, in_plane / lattice.x_mm.count,
          static_cast<int>(bin / lattice.plane())};
}

LatticePlace place_of(const RefinedPose& refined, const PoseLattice& lattice) {
  const glm::dvec2 xy_mm = refined.T_object_robot * lattice.pivot_mm;
  const double middle_rad = (lattice.theta_rad.lower + lattice.theta_rad.upper) / 2.0;
  return {xy_mm.x, xy_mm.y,
          middle_rad +
              wrap_angle(refined.T_object_robot.theta_rad - middle_rad, 2.0 * std::numbers::pi)};
}

LatticePlace variances_of(const RefinedPose& refined, const PoseLattice& lattice) {
  // The translation of T_object_robot is (x, y) - R(theta) pivot.
  const glm::dvec2 slope =
      rotate(refined.T_object_robot.theta_rad + std::numbers::pi / 2.0, lattice.pivot_mm);
  const std::array<double, 9>& c = refined.covariance;
  const auto variance = [&](int i) {
    return c[4 * i] + 2.0 * slope[i] * c[3 * i + 2] + slope[i] * slope[i] * c[8];
  };
  return {variance(0), variance(1), c[8]};
}

BeliefPeaks peaks_of(const BinnedObject& of, std::span<const BinShare> bins,
                     std::span<const AxisIndices> at) {
  BeliefCells cells(of, bins, at);
  cells.climb();
  BeliefPeaks peaks{.count = cells.peaks(), .of_bin = {}};
  for (const AxisIndices& bin : at) {
    peaks.of_bin.push_back(cells.peak_of(bin));
  }
  return peaks;
}

}  // namespace palpate
