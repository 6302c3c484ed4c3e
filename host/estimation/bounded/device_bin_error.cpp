#include "estimation/bounded/device_bin_error.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/contact_kernel.hpp"
#include "shaders/interface.h"

// A bound of the rounding of evaluate_boxes, by the precision that Vulkan asks of float32: sums,
// products, floor and comparisons are rounded correctly (a fused product is closer still),
// quotients are within 2.5 ULP, exp(x) and exp2(x) within (3 + 2 |x|) ULP, log(x) within 3 ULP, or
// 2^-21 for x in [1/2, 2]. A unit of roundoff is u, a ULP at most 2 u. Terms of the second order
// are covered by `second_order`.

namespace palpate {

namespace {

constexpr double u = 0x1p-24;
constexpr double log_near_one = 0x1p-21;
constexpr double second_order = 1.001;
/// Exponents of 2 that the kernel's odds are clamped to, see contact_likelihood.glsl.
constexpr double most_exponent = 30.0;
constexpr double log2_e = 1.4426950408889634;

double exp_error(double largest_argument) { return (3.0 + 2.0 * largest_argument) * 2.0 * u; }

/// Of one logarithm of a number whose own is at most `nats` in magnitude.
double log_error(double nats) { return std::max(log_near_one, 6.0 * u * nats); }

}  // namespace

DeviceBinError::DeviceBinError(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                               const PoseLattice& lattice)
    : form_(contact),
      products_(evaluates_products(contact)),
      has_floor_(contact.gamma > 0.0),
      trust_(1.0 - contact.gamma) {
  const double prior = log_odds_from_probability(*contact.prior);
  prior_rounding_ = std::abs(static_cast<float>(prior) - prior);
  for (const Hypothesis& hypothesis : hypotheses) {
    extents_.push_back(extent_of(hypothesis.compared(), prior, lattice));
  }
}

double DeviceBinError::nats(std::size_t object, const KnownElements& elements) const {
  const MapExtent& map = extents_[object];
  const auto count = static_cast<double>(elements.from_pivot_mm.size());
  // Where an element lies in a cell: the fractions of element and bin as floats, and their sum
  // below
  // 2. Interpolation along an axis rounds a difference, a product and a sum, and does so along x
  // and then along y.
  const double moved = map.change(map.place_error(elements) + 2.0 * 0x1p-25 + 0x1p-24);
  const double log_odds = moved + u * (4.0 * map.steepest + 2.0 * map.largest) + prior_rounding_;

  if (form_.kind == ReadingForm::Kind::table) {
    // The place: the first node as a float, a difference, a product and its factor. Then the
    // numbers as floats, a product and a sum, sums of FACTORS_PER_LOG in one float, and the result.
    const TableExtent table = form_.table_extent(object);
    const double argument = log_odds + u * (std::abs(form_.first_log_odds) + 3.0 * table.width);
    const double each = std::min(table.steepest * argument, 2.0 * table.largest) +
                        (8.0 + shaders::FACTORS_PER_LOG + 2.0) * u * table.largest;
    return second_order * count * each;
  }

  const double largest = form_.largest_nats(map.largest);
  // The sum in two floats is rounded to one, and again where the elements are portioned.
  double each = log_odds + 2.0 * u * largest;
  double groups = 0.0;
  if (products_) {
    // Eq. 7 changes by at most 1 nat per nat of log odds: so does a relative error of the odds
    // count. Odds: the product by log2(e), itself rounded, and exp2. Then the numerator's two
    // terms, each rounded, one of them a sum, a product and a sum; the denominator's sum; a
    // quotient and a product.
    const double exponent = std::min(map.largest * log2_e, most_exponent);
    each += 2.0 * u * exponent + exp_error(exponent) + 11.0 * u;
    if (map.largest * log2_e > most_exponent) {
      each += (1.0 / form_.ratio + 1.0) * std::exp2(-most_exponent);
    }
    // One logarithm for FACTORS_PER_LOG elements, or fewer at the end of a reading's elements.
    groups = count / shaders::FACTORS_PER_LOG + 2.0 * static_cast<double>(elements.runs.size()) +
             count / 1024.0;
    each += 6.0 * u * largest;
  } else {
    // log(1 + exp(-|l|)) twice, where an error of exp(-t) relative to 1 + exp(-t) is largest at
    // t = 0; log(1 - gamma); the floor as a float; and four sums, none of which exceeds `depth`.
    const double log_trust = std::abs(std::log(trust_));
    const double depth = map.largest + log_trust + 1.0;
    const double floor =
        has_floor_ ? std::abs(form_.log_ratio) + std::abs(form_.log_scale) + 1.0 : 0.0;
    each += 2.0 * (log_near_one + exp_error(0.0) + 2.0 * u) + log_error(log_trust) + u +
            4.0 * u * depth + 2.0 * u * floor;
  }
  return second_order * (count * each + groups * log_near_one);
}

}  // namespace palpate
