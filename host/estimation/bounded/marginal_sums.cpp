#include "estimation/bounded/marginal_sums.hpp"

#include <cmath>
#include <cstddef>

namespace palpate {

namespace {

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

}  // namespace

MarginalSums::MarginalSums(const PoseLattice& lattice, const PoseLattice& grid)
    : lattice_(lattice),
      sums_{.grid = grid,
            .xy = std::vector<double>(static_cast<std::size_t>(grid.plane())),
            .theta = std::vector<double>(static_cast<std::size_t>(grid.theta_rad.count))},
      same_pivot_(lattice.pivot_mm == grid.pivot_mm) {
  if (!same_pivot_) {
    return;
  }
  // About the origin a bin's indices depend on one axis each, without rounding.
  PoseLattice from = lattice;
  PoseLattice to = grid;
  from.pivot_mm = to.pivot_mm = {};
  const double x = from.x_mm.centre(0);
  const double y = from.y_mm.centre(0);
  const double theta = from.theta_rad.centre(0);
  const auto bin = [&](double x_mm, double y_mm, double theta_rad) {
    return to.bin_of(from.T_object_robot(x_mm, y_mm, theta_rad));
  };
  const auto in_grid = [](const Axis& axis, const auto& index_of) {
    std::vector<std::int32_t> indices(static_cast<std::size_t>(axis.count));
    for (int i = 0; i < axis.count; ++i) {
      indices[i] = static_cast<std::int32_t>(index_of(axis.centre(i)));
    }
    return indices;
  };
  column_ = in_grid(from.x_mm, [&](double at) { return bin(at, y, theta) % to.x_mm.count; });
  row_ =
      in_grid(from.y_mm, [&](double at) { return bin(x, at, theta) % to.plane() / to.x_mm.count; });
  theta_ = in_grid(from.theta_rad, [&](double at) { return bin(x, y, at) / to.plane(); });
}

void MarginalSums::add(const BinBox& box, std::span<const double> log_likelihood,
                       double log_offset) {
  if (!same_pivot_) {
    add_one_by_one(box, log_likelihood, log_offset);
    return;
  }
  const std::span columns = std::span(column_).subspan(box.x_first, box.x_count);
  const std::span rows = std::span(row_).subspan(box.y_first, box.y_count);
  const auto width = static_cast<std::size_t>(sums_.grid.x_mm.count);
  double all = 0.0;
  if (log_likelihood.size() == 1) {
    const double p = std::exp(log_likelihood[0] + log_offset);
    for_runs(rows, [&](std::int32_t row, double of_rows) {
      for_runs(columns, [&](std::int32_t column, double of_columns) {
        sums_.xy[row * width + column] += p * of_rows * of_columns;
      });
    });
    all = p * static_cast<double>(box.bins());
  } else {
    auto log_p = log_likelihood.begin();
    for (const std::int32_t row : rows) {
      for (const std::int32_t column : columns) {
        const double p = std::exp(*log_p++ + log_offset);
        sums_.xy[row * width + column] += p;
        all += p;
      }
    }
  }
  sums_.theta[theta_[box.theta]] += all;
}

void MarginalSums::add_one_by_one(const BinBox& box, std::span<const double> log_likelihood,
                                  double log_offset) {
  const PoseLattice& grid = sums_.grid;
  for (std::int64_t i = 0; i < box.bins(); ++i) {
    const double p = std::exp(log_likelihood[log_likelihood.size() == 1 ? 0 : i] + log_offset);
    const std::int64_t at = grid.bin_of(lattice_.T_object_robot(
        lattice_.x_mm.centre(static_cast<int>(box.x_first + i % box.x_count)),
        lattice_.y_mm.centre(static_cast<int>(box.y_first + i / box.x_count)),
        lattice_.theta_rad.centre(box.theta)));
    sums_.xy[at % grid.plane()] += p;
    sums_.theta[at / grid.plane()] += p;
  }
}

}  // namespace palpate
