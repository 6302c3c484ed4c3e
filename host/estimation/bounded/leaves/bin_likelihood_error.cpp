#include <algorithm>
#include <cmath>

#include "estimation/bounded/leaves/bin_likelihood.hpp"

// Bounds of BinLikelihood's rounding. A unit of roundoff is u for the lanes' numbers, v for
// float64: every sum, product and quotient has a relative error of at most one unit. Terms of the
// second order are covered by `second_order`.

namespace palpate {

namespace {

constexpr double v = 0x1p-53;
constexpr double second_order = 1.001;

template <typename Lane>
constexpr double unit = sizeof(Lane) == 4 ? 0x1p-24 : v;

/// Relative error of 2^f. VectorMath's polynomials are within 4.4e-7 and 7.8e-14 of 2^f. Horner's
/// rule adds at most (2 k + 1) u of each term c_k f^k, in all 2.5 u where 2^f is at least 0.7.
template <typename Lane>
constexpr double exp_error = (sizeof(Lane) == 4 ? 4.5e-7 : 8e-14) + 4.0 * unit<Lane>;

/// Largest magnitude whose exponential is not clamped, in nats.
template <typename Lane>
constexpr double most_exponent = sizeof(Lane) == 4 ? 88.0 : 709.0;

double farthest(const Axis& axis) { return std::max(std::abs(axis.lower), std::abs(axis.upper)); }

}  // namespace

double PlacedMap::place_error(const KnownElements& elements) const {
  double norm_cells = 0.0;
  for (const glm::dvec2& p_mm : elements.from_pivot_mm) {
    norm_cells = std::max(norm_cells, (std::abs(p_mm.x) + std::abs(p_mm.y)) / cell_mm);
  }
  // Rotation: cosine, sine, their quotients by the cell, two products and a sum. Bins: a
  // difference, a quotient and two sums.
  return 6.0 * v * std::min(norm_cells, 2.0 * reach_cells) +
         4.0 * v * (lattice_cells + reach_cells);
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
      // Places within a patch are below 4 cells: these steps leave them exact in 24 and 53 bits.
      float_grid(reach_cells, 0x1p-22),
      double_grid(reach_cells, 0x1p-51) {
  const double beyond = nodes.prior_log_odds();
  double least = beyond;
  double most = beyond;
  const auto node = [&](int i, int j) {
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny ? double{map.at(i, j)} : beyond;
  };
  for (int j = -1; j < map.ny; ++j) {
    for (int i = -1; i < map.nx; ++i) {
      const double here = node(i, j);
      least = std::min(least, here);
      most = std::max(most, here);
      steepest =
          std::max({steepest, std::abs(node(i + 1, j) - here), std::abs(node(i, j + 1) - here)});
    }
  }
  largest = std::max(std::abs(least), std::abs(most));
  range = most - least;
}

template <typename Lane>
double BinLikelihood::exact_error_in(std::size_t object, const KnownElements& elements) const {
  constexpr double u = unit<Lane>;
  const PlacedMap& map = maps_[object];
  const auto count = static_cast<double>(elements.from_pivot_mm.size());

  // Bins and elements are rounded to the grid, half a step each. Interpolation along an axis rounds
  // a difference, a product and a sum, and does so along y and then along x. Float32 has the marker
  // in the place of the prior.
  const double moved = map.change(map.place_error(elements) + map.grid<Lane>().step());
  const double interpolated = u * (4.0 * map.steepest + 2.0 * map.largest);
  const double marker =
      sizeof(Lane) == 4 ? std::abs(double{map.nodes.marker()} - map.nodes.prior_log_odds()) : 0.0;
  const double log_odds = moved + interpolated + marker;

  if (form_.kind == ReadingForm::Kind::table) {
    // The place in the table: the first node, a difference, and a quotient and two products of the
    // scale. Then the table's numbers, a product and a sum. Float32 adds up some elements' logs by
    // itself, float64 these sums.
    const TableExtent table = form_.table_extent(object);
    const double argument =
        log_odds + u * (map.largest + 2.0 * std::abs(form_.first_log_odds) + 4.0 * table.width);
    const double summed = sizeof(Lane) == 4 ? floats_together * u : 0.0;
    const double subnormal = sizeof(Lane) == 4 ? 16.0 * 0x1p-149 : 0.0;  // has no unit of roundoff
    const double each = std::min(table.steepest * argument, 2.0 * table.largest) +
                        (8.0 * u + summed + v * count) * table.largest + subnormal;
    return second_order * count * each;
  }

  // Eq. 7 changes by at most 1 nat per nat of log odds, so that a relative error of e = exp(-|z|)
  // changes it by no more than that error. e: the product by log2(e), itself rounded, and 2^f.
  const double exponential = 2.0 * u * std::min(map.largest, most_exponent<Lane>) + exp_error<Lane>;
  const double nats = form_.largest_nats(map.largest);
  if (form_.kind == ReadingForm::Kind::logs) {
    // Two exponentials, t exp(-t) of the relative error of the second one's argument counts; log r
    // twice; 4 roundings each of numerator, denominator, quotient and its logarithm. Then two sums,
    // and the sum over elements.
    const double each = log_odds + exponential + exp_error<Lane> + 16.0 * v + 4.0 * v * nats;
    return second_order * count * (each + v * count * nats);
  }
  // Numerator: r, a product, a sum; denominator: a sum; two products over the elements. In float64,
  // the powers of two, the logarithm and the scale.
  return second_order * count * (log_odds + exponential + 6.0 * u) +
         16.0 * v * (count * nats + 1.0);
}

double BinLikelihood::error(std::size_t object, const KnownElements& elements,
                            Arithmetic arithmetic) const {
  const double of_means =
      displaced_ ? static_cast<double>(elements.touches.size()) * displaced_->mean_error() : 0.0;
  return of_means + exact_error(object, elements, arithmetic);
}

double BinLikelihood::exact_error(std::size_t object, const KnownElements& elements,
                                  Arithmetic arithmetic) const {
  return in_float32(arithmetic) ? exact_error_in<float>(object, elements)
                                : exact_error_in<double>(object, elements);
}

}  // namespace palpate
