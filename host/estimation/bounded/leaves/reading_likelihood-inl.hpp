// The likelihood of bins: by Eq. 7 as products over the elements (ReadingForm), or as sums of the
// elements' logs. For files that are compiled once for every set of instructions.

#include <cstddef>
#include <cstdint>
#include <span>

#include <hwy/highway.h>

#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

/// The product of the likelihoods of some elements in every lane, see ReadingForm.
template <class D>
struct Products {
  hn::Vec<D> numerator;
  hn::Vec<D> denominator;
  hn::Vec<hn::RebindToUnsigned<D>> exponent;  ///< taken out, modulo 2^64

  explicit Products(D d)
      : numerator(hn::Set(d, 1.0)),
        denominator(hn::Set(d, 1.0)),
        exponent(hn::Zero(hn::RebindToUnsigned<D>())) {}
};

template <class D>
HWY_INLINE void multiply(D d, hn::Vec<D> l, hn::Vec<D> at_negative, hn::Vec<D> at_positive,
                         Products<D>& product) {
  const auto one = hn::Set(d, 1.0);
  const auto e = exp_of_minus(d, hn::Abs(l));
  const auto negative = hn::Lt(l, hn::Zero(d));
  const auto numerator = hn::IfThenElse(negative, hn::Add(at_negative, hn::Mul(at_positive, e)),
                                        hn::Add(at_positive, hn::Mul(at_negative, e)));
  product.numerator = hn::Mul(product.numerator, numerator);
  product.denominator = hn::Mul(product.denominator, hn::Add(one, e));
}

/// Takes powers of two out of the product.
template <class D>
HWY_INLINE void take_out(D d, Products<D>& product) {
  const hn::RebindToUnsigned<D> du;
  const auto mantissa = hn::Set(du, VectorMath::mantissa_mask);
  const auto one = hn::Set(du, VectorMath::one_bits);
  const auto n = hn::BitCast(du, product.numerator);
  const auto m = hn::BitCast(du, product.denominator);
  constexpr int shift = VectorMath::mantissa_bits;
  product.exponent =
      hn::Add(product.exponent, hn::Sub(hn::ShiftRight<shift>(n), hn::ShiftRight<shift>(m)));
  product.numerator = hn::BitCast(d, hn::Or(hn::And(n, mantissa), one));
  product.denominator = hn::BitCast(d, hn::Or(hn::And(m, mantissa), one));
}

/// Sum of the logarithms of all lanes' factors.
template <class D>
void store_logs(D d, const Products<D>& product, double constant, double* log_likelihood) {
  const auto power = hn::ConvertTo(d, hn::BitCast(hn::RebindToSigned<D>(), product.exponent));
  const auto x = hn::Div(product.numerator, product.denominator);
  const auto logs = hn::Add(hn::Mul(power, hn::Set(d, VectorMath::ln2)), log_near_one(d, x));
  hn::StoreU(hn::Add(logs, hn::Set(d, constant)), d, log_likelihood);
}

/// The bins of one vector, as products over the elements.
/// @param log_odds_at (element): in every lane
template <class D, class LogOddsAt>
void multiply_elements(D d, const LogOddsAt& log_odds_at, std::span<const ReadingRun> runs,
                       const ReadingForm& form, double* log_likelihood) {
  const auto ratio = hn::Set(d, form.ratio);
  const auto one = hn::Set(d, 1.0);
  Products<D> product(d);
  int since = 0;
  for (const ReadingRun& run : runs) {
    const bool contact = run.reading != Reading::no_contact;
    const auto at_negative = contact ? ratio : one;
    const auto at_positive = contact ? one : ratio;
    for (std::size_t e = run.begin; e < run.end; ++e) {
      multiply(d, log_odds_at(e), at_negative, at_positive, product);
      if (++since == form.interval) {
        take_out(d, product);
        since = 0;
      }
    }
  }
  take_out(d, product);
  const std::size_t count = runs.empty() ? 0 : runs.back().end;
  store_logs(d, product, static_cast<double>(count) * form.log_scale, log_likelihood);
}

/// The bins of one vector, as sums of the elements' log-likelihoods.
/// @param log_odds_at (element): in every lane
/// @param logs_of (reading): its log-likelihoods, at(d, log odds)
template <class D, class LogOddsAt, class LogsOf>
void add_elements(D d, const LogOddsAt& log_odds_at, std::span<const ReadingRun> runs,
                  const LogsOf& logs_of, double* log_likelihood) {
  auto sum = hn::Zero(d);
  for (const ReadingRun& run : runs) {
    const auto logs = logs_of(run.reading);
    for (std::size_t e = run.begin; e < run.end; ++e) {
      sum = hn::Add(sum, logs.at(d, log_odds_at(e)));
    }
  }
  hn::StoreU(sum, d, log_likelihood);
}

/// The log-likelihoods of one reading by Eq. 7, where r is small; see ReadingForm.
template <class D>
class LogisticFloor {
 public:
  LogisticFloor(D d, const ReadingForm& form, Reading reading)
      : sign_(hn::Set(d, reading == Reading::no_contact ? -1.0 : 1.0)),
        log_ratio_(hn::Set(d, form.log_ratio)),
        log_scale_(hn::Set(d, form.log_scale)) {}

  HWY_INLINE hn::Vec<D> at(D d, hn::Vec<D> l) const {
    const auto one = hn::Set(d, 1.0);
    const auto z = hn::Mul(l, sign_);
    const auto e = exp_of_minus(d, hn::Abs(z));
    const auto falling = hn::Min(z, hn::Zero(d));
    const auto other = exp_of_minus(d, hn::Abs(hn::Sub(falling, log_ratio_)));
    const auto factor = hn::IfThenElse(hn::Lt(z, hn::Zero(d)), one, e);
    const auto x = hn::Div(hn::Add(one, hn::Mul(other, factor)), hn::Add(one, e));
    return hn::Add(hn::Add(hn::Max(falling, log_ratio_), log_scale_), log_near_one(d, x));
  }

 private:
  hn::Vec<D> sign_;
  hn::Vec<D> log_ratio_;
  hn::Vec<D> log_scale_;
};

/// The log-likelihoods of one reading in a table.
template <class D>
class TableRow {
 public:
  TableRow(D d, const ReadingForm& form, std::size_t object, Reading reading)
      : values_(form.values(object, reading)),
        differences_(values_ + form.nodes),
        first_(hn::Set(d, form.first_log_odds)),
        scale_(hn::Set(d, form.nodes_per_nat)),
        last_(hn::Set(d, static_cast<double>(form.nodes - 1))),
        last_segment_(hn::Set(d, static_cast<double>(form.nodes - 2))) {}

  HWY_INLINE hn::Vec<D> at(D d, hn::Vec<D> l) const {
    const auto at = hn::Max(hn::Zero(d), hn::Min(hn::Mul(hn::Sub(l, first_), scale_), last_));
    const auto segment = hn::Min(hn::Floor(at), last_segment_);
    const auto index = whole_number(d, segment);
    const auto difference = hn::GatherIndex(d, differences_, index);
    return hn::Add(hn::GatherIndex(d, values_, index), hn::Mul(difference, hn::Sub(at, segment)));
  }

 private:
  const double* values_;
  const double* differences_;
  hn::Vec<D> first_;
  hn::Vec<D> scale_;
  hn::Vec<D> last_;
  hn::Vec<D> last_segment_;
};

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();
