#include "estimation/bin_belief.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "estimation/hypotheses.hpp"
#include "model/random.hpp"
#include "model/refuse.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

/// Share of a belief that a block of bins, or an object, may hold unvisited: shows in no result.
constexpr double negligible_share = 1e-12;

constexpr double rounding = 1e-5;  ///< of a block's sum in float32

/// Calls visit(grid bin, number of bins) for every run of bins that lie in one of the grid's.
template <typename Visit>
void for_runs(std::span<const std::int64_t> grid_bins, const Visit& visit) {
  for (std::size_t first = 0, end = 0; first < grid_bins.size(); first = end) {
    while (end < grid_bins.size() && grid_bins[end] == grid_bins[first]) {
      ++end;
    }
    visit(grid_bins[first], static_cast<double>(end - first));
  }
}

/// Sums over a grid of the probabilities of a lattice's bins, by where their centres lie. At one
/// theta the indices of these depend on one axis each; about equal pivots they do at all thetas.
class GridSums {
 public:
  GridSums(const PoseLattice& from, Marginals& sums)
      : from_(from), sums_(sums), to_(sums.grid), equal_pivots_(from.pivot_mm == to_.pivot_mm) {
    to_.pivot_mm = {};
    if (equal_pivots_) {
      place(whole_plane(from, 0));
    }
  }

  /// Adds exp(log-likelihood - reference + log_scale) of a box's bins.
  void add(const BinBox& box, std::span<const double> log_likelihood, double reference,
           double log_scale) {
    if (!equal_pivots_) {
      place(box);
    }
    const auto part_of = [&](std::span<const std::int64_t> indices, int first, int count) {
      return indices.subspan(static_cast<std::size_t>(equal_pivots_ ? first : 0),
                             static_cast<std::size_t>(count));
    };
    const std::span columns = part_of(columns_, box.x_first, box.x_count);
    const std::span rows = part_of(rows_, box.y_first, box.y_count);
    double all = 0.0;
    if (log_likelihood.size() == 1) {
      const double p = std::exp((log_likelihood[0] - reference) + log_scale);
      for_runs(rows, [&](std::int64_t row, double of_rows) {
        for_runs(columns, [&](std::int64_t column, double of_columns) {
          sums_.xy[row + column] += p * of_rows * of_columns;
        });
      });
      all = p * static_cast<double>(box.bins());
    } else {
      auto log_p = log_likelihood.begin();
      for (const std::int64_t row : rows) {
        for (const std::int64_t column : columns) {
          const double p = std::exp((*log_p++ - reference) + log_scale);
          sums_.xy[row + column] += p;
          all += p;
        }
      }
    }
    sums_.theta[to_.bin_of({{}, from_.theta_rad.centre(box.theta)}) / to_.plane()] += all;
  }

 private:
  /// Finds the columns and rows of a box.
  void place(const BinBox& box) {
    const glm::dvec2 shift_mm =
        rotate(from_.theta_rad.centre(box.theta), sums_.grid.pivot_mm - from_.pivot_mm);
    const auto bin_at = [&](int column, int row) {
      const glm::dvec2 place_mm(from_.x_mm.centre(column), from_.y_mm.centre(row));
      return to_.bin_of({place_mm + shift_mm, 0.0});
    };
    columns_.clear();
    for (int i = 0; i < box.x_count; ++i) {
      columns_.push_back(bin_at(box.x_first + i, box.y_first) % to_.x_mm.count);
    }
    rows_.clear();
    for (int i = 0; i < box.y_count; ++i) {
      const std::int64_t at = bin_at(box.x_first, box.y_first + i) % to_.plane();
      rows_.push_back(at - at % to_.x_mm.count);
    }
  }

  const PoseLattice& from_;
  Marginals& sums_;
  PoseLattice to_;  ///< the grid about the origin
  bool equal_pivots_;
  std::vector<std::int64_t> columns_;
  std::vector<std::int64_t> rows_;  ///< of a plane: index of their first bins
};

/// T_object_robot of a pose that is uniform within a bin.
Pose draw_within(std::int64_t bin, const PoseLattice& lattice, Random& random) {
  const auto within = [&](const Axis& axis, std::int64_t index) {
    return axis.centre(static_cast<int>(index)) + random.uniform(-0.5, 0.5) * axis.step();
  };
  const double x = within(lattice.x_mm, bin % lattice.x_mm.count);
  const double y = within(lattice.y_mm, bin % lattice.plane() / lattice.x_mm.count);
  const double theta = within(lattice.theta_rad, bin / lattice.plane());
  return lattice.T_object_robot(x, y, theta);
}

}  // namespace

std::vector<int> BinBelief::likely_objects() const {
  std::vector<int> likely;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!(objects[i].log_identity < std::log(negligible_share))) {
      likely.push_back(static_cast<int>(i));
    }
  }
  return likely;
}

Marginals BinBelief::marginals(int object, PoseLattice grid) const {
  require_object(object, objects.size());
  grid.collapse_fixed().validate();
  Marginals sums{.grid = grid,
                 .xy = std::vector<double>(static_cast<std::size_t>(grid.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(grid.theta_rad.count))};
  const Object& of = objects[object];
  const double log_scale = of.log_share + of.log_identity + log_objects;
  if (std::exp(of.log_identity + log_objects) == 0.0) {
    return sums;
  }
  GridSums on_grid(lattice, sums);
  visit(std::span(&object, 1), {negligible_share},
        [&](const BinBox& box, std::span<const double> log_likelihood) {
          on_grid.add(box, log_likelihood, of.reference, log_scale);
        });
  return sums;
}

std::vector<std::vector<BinShare>> BinBelief::likely_bins(std::span<const int> asked,
                                                          double least_share) const {
  for (const int object : asked) {
    require_object(object, objects.size());
  }
  require(least_share >= 0.0, "least_share", least_share, "give a number from 0");
  const double least = std::log(least_share);
  std::vector<std::vector<BinShare>> likely(objects.size());
  visit(asked, {(1.0 - rounding) * least_share},
        [&](const BinBox& box, std::span<const double> log_likelihood) {
          const bool alike = log_likelihood.size() == 1;
          const Object& of = objects[box.object];
          if (alike && of.log_share_of(log_likelihood[0]) < least) {
            return;
          }
          for (std::int64_t i = 0; i < box.bins(); ++i) {
            const double log_share =
                of.log_share_of(log_likelihood[alike ? 0 : static_cast<std::size_t>(i)]);
            if (log_share >= least) {
              likely[box.object].push_back({box.bin(i, lattice), std::exp(log_share)});
            }
          }
        });
  std::vector<std::vector<BinShare>> of_asked;
  for (const int object : asked) {
    of_asked.push_back(likely[object]);
  }
  return of_asked;
}

double BinBelief::entropy() const {
  double entropy = 0.0;
  visit(likely_objects(), {negligible_share},
        [&](const BinBox& box, std::span<const double> log_likelihood) {
          const double times = log_likelihood.size() == 1 ? static_cast<double>(box.bins()) : 1.0;
          for (const double l : log_likelihood) {
            const double log_p =
                objects[box.object].log_share_of(l) + objects[box.object].log_identity;
            entropy -= times * std::exp(log_p) * log_p;
          }
        });
  return entropy;
}

std::vector<PoseSample> BinBelief::sample(std::size_t count, std::uint64_t seed) const {
  struct DrawnBin {
    std::int32_t object = 0;
    std::int64_t bin = 0;
  };
  Random random(seed, Stream::belief);
  const std::vector<double> parts = one_in_each_part(count, random);
  std::vector<DrawnBin> draws;
  DrawnBin best;
  double largest = 0.0;
  double asked = 0.0;  // part of the belief in the blocks that were asked for
  const auto has_draw = [&](std::size_t object, double share) {
    const auto first = std::ranges::lower_bound(parts, asked - rounding);
    asked += share * std::exp(objects[object].log_identity);
    return first != parts.end() && *first <= asked + rounding;
  };
  double reached = 0.0;  // part of the belief that was visited
  visit(likely_objects(), {negligible_share, has_draw},
        [&](const BinBox& box, std::span<const double> log_likelihood) {
          const std::int64_t alike = log_likelihood.size() == 1 ? box.bins() : 1;
          const Object& of = objects[box.object];
          for (std::size_t i = 0; i < log_likelihood.size(); ++i) {
            const auto first = static_cast<std::int64_t>(i);
            const double p = std::exp(of.log_share_of(log_likelihood[i]) + of.log_identity);
            const double after = reached + p * static_cast<double>(alike);
            while (draws.size() < parts.size() && parts[draws.size()] < after) {
              const auto within = static_cast<std::int64_t>((parts[draws.size()] - reached) / p);
              draws.push_back({box.object, box.bin(first + std::min(within, alike - 1), lattice)});
            }
            if (p > largest) {
              largest = p;
              best = {box.object, box.bin(first, lattice)};
            }
            reached = after;
          }
        });
  draws.resize(count, best);  // rounding may leave the last draw out
  std::ranges::sort(draws, {}, [](const DrawnBin& of) { return std::tie(of.object, of.bin); });
  std::vector<PoseSample> samples;
  samples.reserve(count);
  for (const DrawnBin& drawn : draws) {
    samples.push_back({drawn.object, draw_within(drawn.bin, lattice, random)});
  }
  return samples;
}

}  // namespace palpate
