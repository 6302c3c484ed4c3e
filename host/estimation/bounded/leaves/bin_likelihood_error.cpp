#include <algorithm>
#include <cmath>

#include "estimation/bounded/leaves/bin_likelihood.hpp"

// Bounds of BinLikelihood's rounding. Every sum, product and quotient has a relative error of at
// most one unit of roundoff, u. Terms of the second order are covered by `second_order`.

namespace palpate {

namespace {

constexpr double u = 0x1p-53;
constexpr double second_order = 1.001;

/// Relative error of 2^f. VectorMath's polynomial is within 7.8e-14 of 2^f. Horner's rule adds at
/// most (2 k + 1) u of each term c_k f^k, in all 2.5 u where 2^f is at least 0.7.
constexpr double exp_error = 8e-14 + 4.0 * u;

/// Largest magnitude whose exponential is not clamped, in nats.
constexpr double most_exponent = 709.0;

double farthest(const Axis& axis) { return std::max(std::abs(axis.lower), std::abs(axis.upper)); }

}  // namespace

double PlacedMap::place_error(const KnownElements& elements) const {
  double norm_cells = 0.0;
  for (const glm::dvec2& p_mm : elements.from_pivot_mm) {
    norm_cells = std::max(norm_cells, (std::abs(p_mm.x) + std::abs(p_mm.y)) / cell_mm);
  }
  // Rotation: cosine, sine, their quotients by the cell, two products and a sum. Bins: a
  // difference, a quotient and two sums.
  return 6.0 * u * std::min(norm_cells, 2.0 * reach_cells) +
         4.0 * u * (lattice_cells + reach_cells);
}

double PlacedMap::change(double place_cells) const {
  return std::min(2.0 * place_cells * steepest, range);
}

PlacedMap::PlacedMap(const OccupancyGrid& map, double prior, const PoseLattice& lattice)
    : nodes(map, prior),
      cell_mm(map.cell_mm),
      origin_mm(map.origin_mm),
      lattice_cells((std::max(farthest(lattice.x_mm), farthest(lattice.y_mm)) +
                     std::max(std::abs(map.origin_mm.x), std::abs(map.origin_mm.y))) /
                    map.cell_mm),
      reach_cells(lattice_cells + std::max(map.nx, map.ny) + 20.0),
      grid(reach_cells) {
  const double beyond = nodes.prior_log_odds();
  double least = beyond;
  double highest = beyond;
  const auto node = [&](int i, int j) {
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny ? double{map.at(i, j)} : beyond;
  };
  for (int j = -1; j < map.ny; ++j) {
    for (int i = -1; i < map.nx; ++i) {
      const double here = node(i, j);
      least = std::min(least, here);
      highest = std::max(highest, here);
      steepest =
          std::max({steepest, std::abs(node(i + 1, j) - here), std::abs(node(i, j + 1) - here)});
    }
  }
  largest = std::max(std::abs(least), std::abs(highest));
  range = highest - least;
}

double BinLikelihood::undisplaced_error(std::size_t object, const KnownElements& elements) const {
  const PlacedMap& map = maps_[object];
  const auto count = static_cast<double>(elements.from_pivot_mm.size());

  // Bins and elements are rounded to the grid, half a step each. Interpolation along an axis rounds
  // a difference, a product and a sum, and does so along y and then along x.
  const double moved = map.change(map.place_error(elements) + map.grid.step());
  const double interpolated = u * (4.0 * map.steepest + 2.0 * map.largest);
  const double log_odds = moved + interpolated;

  if (form_.kind == ReadingForm::Kind::table) {
    // The place in the table: the first node, a difference, and a quotient and two products of the
    // scale. Then the table's numbers, a product and a sum, and the sum over elements.
    const TableExtent table = form_.table_extent(object);
    const double argument =
        log_odds + u * (map.largest + 2.0 * std::abs(form_.first_log_odds) + 4.0 * table.width);
    const double each = std::min(table.steepest * argument, 2.0 * table.largest) +
                        (8.0 * u + u * count) * table.largest;
    return second_order * count * each;
  }

  // Eq. 7 changes by at most 1 nat per nat of log odds, so that a relative error of e = exp(-|z|)
  // changes it by no more than that error. e: the product by log2(e), itself rounded, and 2^f.
  const double exponential = 2.0 * u * std::min(map.largest, most_exponent) + exp_error;
  const double nats = form_.largest_nats(map.largest);
  if (form_.kind == ReadingForm::Kind::logs) {
    // Two exponentials, t exp(-t) of the relative error of the second one's argument counts; log r
    // twice; 4 roundings each of numerator, denominator, quotient and its logarithm. Then two sums,
    // and the sum over elements.
    const double each = log_odds + exponential + exp_error + 16.0 * u + 4.0 * u * nats;
    return second_order * count * (each + u * count * nats);
  }
  // Numerator: r, a product, a sum; denominator: a sum; two products over the elements. Then the
  // powers of two, the logarithm and the scale.
  return second_order * count * (log_odds + exponential + 6.0 * u) +
         16.0 * u * (count * nats + 1.0);
}

double BinLikelihood::error(std::size_t object, const KnownElements& elements) const {
  const double of_means =
      displaced_ ? static_cast<double>(elements.touches.size()) * displaced_->mean_error() : 0.0;
  return of_means + undisplaced_error(object, elements);
}

}  // namespace palpate
