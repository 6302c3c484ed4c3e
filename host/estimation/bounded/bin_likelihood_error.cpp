#include <algorithm>
#include <cmath>

#include "bin_likelihood.hpp"

// Bounds of BinLikelihood's rounding. A unit of roundoff is u for the lanes' numbers, v for
// float64: every sum, product and quotient has a relative error of at most one unit. Terms of the
// second order are covered by `second_order`.

namespace palpate {

namespace {

constexpr double v = 0x1p-53;
constexpr double second_order = 1.001;

template <typename Lane>
constexpr double unit = sizeof(Lane) == 4 ? 0x1p-24 : v;

/// Of 2^f, relative. VectorMath's polynomials are within 4.4e-7 and 4.3e-17 of 2^f. Horner's rule
/// adds at most (2 k + 1) u of each term c_k f^k, in all 2.5 u where 2^f is at least 0.7.
template <typename Lane>
constexpr double exp_error = (sizeof(Lane) == 4 ? 4.5e-7 : 4.5e-17) + 4.0 * unit<Lane>;

/// Largest magnitude whose exponential is not clamped, in nats.
template <typename Lane>
constexpr double most_exponent = sizeof(Lane) == 4 ? 88.0 : 709.0;

double farthest(const Axis& axis) { return std::max(std::abs(axis.lower), std::abs(axis.upper)); }

/// Slopes and magnitudes of a table's rows of one object.
struct TableExtent {
  double largest = 0.0;   ///< magnitude, in nats
  double steepest = 0.0;  ///< difference between neighbouring nodes, in nats
};

TableExtent extent_of(const ReadingForm& form, std::size_t object) {
  TableExtent extent;
  const double* from = form.row(object, Reading::no_contact);
  for (std::size_t i = 0; i < form.levels * form.nodes; ++i) {
    extent.largest = std::max(extent.largest, std::abs(from[2 * i]));
    extent.steepest = std::max(extent.steepest, std::abs(from[2 * i + 1]));
  }
  return extent;
}

}  // namespace

template <typename Lane>
double BinLikelihood::error(std::size_t object, const KnownElements& elements) const {
  constexpr double u = unit<Lane>;
  const Placement& at = placements_[object];
  const MapPatches& map = at.nodes;
  const auto count = static_cast<double>(elements.from_pivot_mm.size());

  // Where an element lies, in cells along one axis. Rotation: cosine, sine, their quotients by the
  // cell, two products and a sum, of coordinates that sum to `norm` at most; elements beyond
  // `reach` along an axis are off the map wherever they lie. Bins: a difference, a quotient and a
  // sum. Both are rounded to the grid, half a step each.
  double norm_cells = 0.0;
  for (const glm::dvec2& p_mm : elements.from_pivot_mm) {
    norm_cells = std::max(norm_cells, (std::abs(p_mm.x) + std::abs(p_mm.y)) / at.cell_mm);
  }
  norm_cells = std::min(norm_cells, 2.0 * at.reach_cells);
  const double lattice_cells = (std::max(farthest(lattice_.x_mm), farthest(lattice_.y_mm)) +
                                std::max(std::abs(at.origin_mm.x), std::abs(at.origin_mm.y))) /
                               at.cell_mm;
  const PositionGrid& grid = sizeof(Lane) == 4 ? at.float_grid : at.double_grid;
  const double place_cells =
      6.0 * v * norm_cells + 4.0 * v * (lattice_cells + at.reach_cells) + grid.step();

  // Log odds change by at most `steepest` per cell along each axis. Interpolation along an axis
  // rounds a difference, a product and a sum, and does so along y and then along x. Float32 has the
  // marker in the place of the prior.
  const double moved = std::min(2.0 * place_cells * map.steepest(), map.range());
  const double interpolated = u * (4.0 * map.steepest() + 2.0 * map.largest());
  const double marker =
      sizeof(Lane) == 4 ? std::abs(double{map.marker()} - map.prior_log_odds()) : 0.0;
  const double log_odds = moved + interpolated + marker;

  if (form_.kind == ReadingForm::Kind::table) {
    // The place in the table: a difference, and a quotient and two products of the scale. Then a
    // product and two sums, and the sum over elements.
    const TableExtent table = extent_of(form_, object);
    const double width = static_cast<double>(form_.nodes - 1) / form_.nodes_per_nat;
    const double argument =
        log_odds + v * (map.largest() + std::abs(form_.first_log_odds) + 4.0 * width);
    const double slope = table.steepest * form_.nodes_per_nat;
    const double each = std::min(slope * argument, 2.0 * table.largest) + 8.0 * v * table.largest +
                        v * count * table.largest;
    return second_order * count * each;
  }

  // Eq. 7 changes by at most 1 nat per nat of log odds, so that a relative error of e = exp(-|z|)
  // changes it by no more than that error. e: the product by log2(e), itself rounded, and 2^f.
  const double exponential =
      2.0 * u * std::min(map.largest(), most_exponent<Lane>) + exp_error<Lane>;
  // Numerator: r, a product, a sum; denominator: a sum; two products over the elements.
  double each = log_odds + exponential + 6.0 * u;
  if (form_.kind == ReadingForm::Kind::sums) {
    // Sums over an interval of numbers that do not exceed `depth`; log r twice; its own
    // exponential, of a difference, t exp(-t) of whose relative error counts.
    const double depth = std::min(map.largest(), std::abs(form_.log_ratio));
    const double interval = sizeof(Lane) == 4 ? form_.float_interval : form_.double_interval;
    each += u * depth * (interval + 2.0) + exp_error<Lane> + 3.0 * u;
  }
  // In float64, the powers of two, the logarithm and the scale; no partial sum exceeds `nats`.
  const double nats =
      std::min(map.largest() + 1.0, std::abs(form_.log_ratio) + 1.0) + std::abs(form_.log_scale);
  return second_order * count * each + 16.0 * v * (count * nats + 1.0) +
         (form_.kind == ReadingForm::Kind::sums ? v * count * count * nats : 0.0);
}

double BinLikelihood::float64_error(std::size_t object, const KnownElements& elements) const {
  return error<double>(object, elements);
}

double BinLikelihood::float32_error(std::size_t object, const KnownElements& elements) const {
  // The result is rounded to float32.
  const auto count = static_cast<double>(elements.from_pivot_mm.size());
  if (form_.kind == ReadingForm::Kind::table) {
    return error<double>(object, elements) +
           second_order * unit<float> * count * extent_of(form_, object).largest;
  }
  const double nats =
      std::min(placements_[object].nodes.largest() + 1.0, std::abs(form_.log_ratio) + 1.0) +
      std::abs(form_.log_scale);
  return error<float>(object, elements) + second_order * unit<float> * count * nats;
}

}  // namespace palpate
