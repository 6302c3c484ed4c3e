#pragma once

#include <cstddef>
#include <vector>

#include "palpate/contact_model.hpp"

namespace palpate {

/// Over all levels of a table's numbers for one object, in nats.
struct TableExtent {
  double largest = 0.0;   ///< magnitude
  double steepest = 0.0;  ///< difference per nat of log odds
  double width = 0.0;     ///< from the first node to the last, in nats of log odds
};

/// How kernels of bins evaluate Eq. 7, or the table in its place. With r = gamma m / s and
/// s = gamma m + 1 - gamma, the likelihood of contact at log odds z (of no contact at -z) is
///
///     s (1 + r e) / (1 + e) for z >= 0,   s (r + e) / (1 + e) for z < 0,   e = exp(-|z|).
///
/// Numerators and denominators are multiplied over elements, powers of two taken out every
/// `interval` elements, and one logarithm taken per bin. Where r is too small for products of
/// r + e, and for gamma = 0, the kernels sum a = max(min(z, 0), log r) and multiply
///
///     1 + exp(-|a - log r|) e' in the place of the numerator,  e' = e for z >= 0, 1 for z < 0:
///
/// for z < 0, r + e = exp(max(z, log r)) (1 + exp(-|z - log r|)).
struct ReadingForm {
  enum class Kind { products, sums, table };

  /// @param contact resolved: with its prior
  explicit ReadingForm(const ContactModel& contact);

  /// The numbers of an object's level: value and difference to the next, for each node.
  const double* row(std::size_t object, Reading level) const {
    return table.data() +
           2 * nodes * ((sets == 1 ? 0 : object) * levels + static_cast<std::size_t>(level));
  }

  TableExtent table_extent(std::size_t object) const;
  /// Largest magnitude of an element's log-likelihood by Eq. 7, for log odds of this magnitude.
  double largest_nats(double largest_log_odds) const;

  Kind kind = Kind::products;
  double ratio = 0.0;      ///< r
  double log_ratio = 0.0;  ///< log r, finite also for r = 0
  double log_scale = 0.0;  ///< log s
  int float_interval = 1;
  int double_interval = 1;

  // What a table has beside.
  double first_log_odds = 0.0;
  double nodes_per_nat = 0.0;
  std::size_t nodes = 0;
  std::size_t levels = 0;
  std::size_t sets = 0;
  std::vector<double> table;  ///< [set, level, node, value | difference]
};

}  // namespace palpate
