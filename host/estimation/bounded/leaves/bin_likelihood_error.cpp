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

double MapExtent::place_error(const KnownElements& elements) const {
  double norm_cells = 0.0;
  for (const glm::dvec2& p_mm : elements.from_pivot_mm) {
    norm_cells = std::max(norm_cells, (std::abs(p_mm.x) + std::abs(p_mm.y)) / cell_mm);
  }
  // Rotation: cosine, sine, their quotients by the cell, two products and a sum. Bins: a
  // difference, a quotient and two sums.
  return 6.0 * v * std::min(norm_cells, 2.0 * reach_cells) +
         4.0 * v * (lattice_cells + reach_cells);
}

double MapExtent::change(double place_cells) const {
  return std::min(2.0 * place_cells * steepest, range);
}

MapExtent::MapExtent(const OccupancyGrid& map, double prior_log_odds, const PoseLattice& lattice)
    : cell_mm(map.cell_mm) {
  double least = prior_log_odds;
  double most = prior_log_odds;
  for (const float cell : map.log_odds) {
    least = std::min(least, double{cell});
    most = std::max(most, double{cell});
  }
  largest = std::max(std::abs(least), std::abs(most));
  range = most - least;
  const auto cell = [&](int i, int j) {
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny ? double{map.at(i, j)} : prior_log_odds;
  };
  for (int j = -1; j < map.ny; ++j) {
    for (int i = -1; i < map.nx; ++i) {
      const double here = cell(i, j);
      steepest =
          std::max({steepest, std::abs(cell(i + 1, j) - here), std::abs(cell(i, j + 1) - here)});
    }
  }
  lattice_cells = (std::max(farthest(lattice.x_mm), farthest(lattice.y_mm)) +
                   std::max(std::abs(map.origin_mm.x), std::abs(map.origin_mm.y))) /
                  map.cell_mm;
  reach_cells = lattice_cells + std::max(map.nx, map.ny) + 20.0;
}

template <typename Lane>
double BinLikelihood::error(std::size_t object, const KnownElements& elements) const {
  constexpr double u = unit<Lane>;
  const Placement& at = placements_[object];
  const auto count = static_cast<double>(elements.from_pivot_mm.size());

  // Bins and elements are rounded to the grid, half a step each. Interpolation along an axis rounds
  // a difference, a product and a sum, and does so along y and then along x. Float32 has the marker
  // in the place of the prior.
  const PositionGrid& grid = sizeof(Lane) == 4 ? at.float_grid : at.double_grid;
  const double moved = at.extent.change(at.extent.place_error(elements) + grid.step());
  const double interpolated = u * (4.0 * at.extent.steepest + 2.0 * at.extent.largest);
  const double marker =
      sizeof(Lane) == 4 ? std::abs(double{at.nodes.marker()} - at.nodes.prior_log_odds()) : 0.0;
  const double log_odds = moved + interpolated + marker;

  if (form_.kind == ReadingForm::Kind::table) {
    // The place in the table: a difference, and a quotient and two products of the scale. Then a
    // product and two sums, and the sum over elements.
    const TableExtent table = form_.table_extent(object);
    const double argument =
        log_odds + v * (at.extent.largest + std::abs(form_.first_log_odds) + 4.0 * table.width);
    const double each = std::min(table.steepest * argument, 2.0 * table.largest) +
                        8.0 * v * table.largest + v * count * table.largest;
    return second_order * count * each;
  }

  // Eq. 7 changes by at most 1 nat per nat of log odds, so that a relative error of e = exp(-|z|)
  // changes it by no more than that error. e: the product by log2(e), itself rounded, and 2^f.
  const double exponential =
      2.0 * u * std::min(at.extent.largest, most_exponent<Lane>) + exp_error<Lane>;
  // Numerator: r, a product, a sum; denominator: a sum; two products over the elements.
  double each = log_odds + exponential + 6.0 * u;
  if (form_.kind == ReadingForm::Kind::sums) {
    // Sums over an interval of numbers that do not exceed `depth`; log r twice; its own
    // exponential, of a difference, t exp(-t) of whose relative error counts.
    const double depth = std::min(at.extent.largest, std::abs(form_.log_ratio));
    const double interval = sizeof(Lane) == 4 ? form_.float_interval : form_.double_interval;
    each += u * depth * (interval + 2.0) + exp_error<Lane> + 3.0 * u;
  }
  // In float64, the powers of two, the logarithm and the scale; no partial sum exceeds `nats`.
  const double nats = form_.largest_nats(at.extent.largest);
  return second_order * count * each + 16.0 * v * (count * nats + 1.0) +
         (form_.kind == ReadingForm::Kind::sums ? v * count * count * nats : 0.0);
}

double BinLikelihood::mean_error(const KnownElements& elements) const {
  return displaced_ ? static_cast<double>(elements.touches.size()) * displaced_->mean_error() : 0.0;
}

double BinLikelihood::float64_error(std::size_t object, const KnownElements& elements) const {
  return error<double>(object, elements) + mean_error(elements);
}

double BinLikelihood::float32_error(std::size_t object, const KnownElements& elements) const {
  // The result is rounded to float32.
  const auto count = static_cast<double>(elements.from_pivot_mm.size());
  if (form_.kind == ReadingForm::Kind::table) {
    return float64_error(object, elements) +
           second_order * unit<float> * count * form_.table_extent(object).largest;
  }
  const double nats = form_.largest_nats(placements_[object].extent.largest);
  return error<float>(object, elements) + mean_error(elements) +
         second_order * unit<float> * count * nats;
}

}  // namespace palpate
