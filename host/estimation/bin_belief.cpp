#include "estimation/bin_belief.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "estimation/hypotheses.hpp"
#include "estimation/pose_draws.hpp"
#include "model/random.hpp"

namespace palpate {

namespace {

/// Share of a belief that a block of bins, or an object, may hold unvisited: shows in no result.
constexpr double negligible_share = 1e-12;

constexpr double rounding = 1e-5;  ///< of a block's sum in float32

/// Calls visit(grid bin, number of bins) for every run of bins that lie in one of the grid's.
template <typename Visit>
void for_runs(std::span<const std::int32_t> grid_bins, const Visit& visit) {
  for (std::size_t first = 0, end = 0; first < grid_bins.size(); first = end) {
    while (end < grid_bins.size() && grid_bins[end] == grid_bins[first]) {
      ++end;
    }
    visit(grid_bins[first], static_cast<double>(end - first));
  }
}

/// Where the bins of a lattice lie on a grid about the same pivot: a bin's indices then depend on
/// one axis each.
struct GridIndices {
  std::vector<std::int32_t> column;  ///< [lattice x]
  std::vector<std::int32_t> row;     ///< [lattice y]
  std::vector<std::int32_t> theta;   ///< [lattice theta]

  GridIndices(PoseLattice from, PoseLattice to) {
    from.pivot_mm = to.pivot_mm = {};  // about the origin, nothing rounds
    const double x = from.x_mm.centre(0);
    const double y = from.y_mm.centre(0);
    const double theta_rad = from.theta_rad.centre(0);
    const auto bin = [&](double x_mm, double y_mm, double rad) {
      return to.bin_of(from.T_object_robot(x_mm, y_mm, rad));
    };
    const auto along = [](const Axis& axis, const auto& index_of) {
      std::vector<std::int32_t> indices(static_cast<std::size_t>(axis.count));
      for (int i = 0; i < axis.count; ++i) {
        indices[i] = static_cast<std::int32_t>(index_of(axis.centre(i)));
      }
      return indices;
    };
    column = along(from.x_mm, [&](double at) { return bin(at, y, theta_rad) % to.x_mm.count; });
    row = along(from.y_mm,
                [&](double at) { return bin(x, at, theta_rad) % to.plane() / to.x_mm.count; });
    theta = along(from.theta_rad, [&](double at) { return bin(x, y, at) / to.plane(); });
  }

  void add(const BinBox& box, std::span<const double> log_likelihood, double reference,
           double log_scale, Marginals& sums) const {
    const std::span columns = std::span(column).subspan(box.x_first, box.x_count);
    const std::span rows = std::span(row).subspan(box.y_first, box.y_count);
    const auto width = static_cast<std::size_t>(sums.grid.x_mm.count);
    double all = 0.0;
    if (log_likelihood.size() == 1) {
      const double p = std::exp((log_likelihood[0] - reference) + log_scale);
      for_runs(rows, [&](std::int32_t at_row, double of_rows) {
        for_runs(columns, [&](std::int32_t at_column, double of_columns) {
          sums.xy[at_row * width + at_column] += p * of_rows * of_columns;
        });
      });
      all = p * static_cast<double>(box.bins());
    } else {
      auto log_p = log_likelihood.begin();
      for (const std::int32_t at_row : rows) {
        for (const std::int32_t at_column : columns) {
          const double p = std::exp((*log_p++ - reference) + log_scale);
          sums.xy[at_row * width + at_column] += p;
          all += p;
        }
      }
    }
    sums.theta[theta[box.theta]] += all;
  }
};

/// Adds the bins of a box by their centres' poses.
void add_by_pose(const BinBox& box, std::span<const double> log_likelihood, double reference,
                 double log_scale, const PoseLattice& lattice, Marginals& sums) {
  for (std::int64_t i = 0; i < box.bins(); ++i) {
    const double l = log_likelihood[log_likelihood.size() == 1 ? 0 : i];
    const double p = std::exp((l - reference) + log_scale);
    const std::int64_t at = sums.grid.bin_of(lattice.T_object_robot(box.bin(i, lattice)));
    sums.xy[at % sums.grid.plane()] += p;
    sums.theta[at / sums.grid.plane()] += p;
  }
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
  std::optional<GridIndices> indices;
  if (lattice.pivot_mm == grid.pivot_mm) {
    indices.emplace(lattice, grid);
  }
  visit(std::span(&object, 1), {negligible_share},
        [&](const BinBox& box, std::span<const double> log_likelihood) {
          if (indices) {
            indices->add(box, log_likelihood, of.reference, log_scale, sums);
          } else {
            add_by_pose(box, log_likelihood, of.reference, log_scale, lattice, sums);
          }
        });
  return sums;
}

std::vector<std::vector<BinShare>> BinBelief::likely_bins(std::span<const int> asked,
                                                          double least_share) const {
  for (const int object : asked) {
    require_object(object, objects.size());
  }
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
