// The likelihood of bins: by Eq. 7 as products over the elements (ReadingForm), or as sums of the
// elements' logs. For files that are compiled once for every set of instructions.

#if defined(PALPATE_READING_LIKELIHOOD_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PALPATE_READING_LIKELIHOOD_INL
#undef PALPATE_READING_LIKELIHOOD_INL
#else
#define PALPATE_READING_LIKELIHOOD_INL
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

#include <hwy/highway.h>

#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "estimation/bounded/leaves/patch_interpolation-inl.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

/// The product of the likelihoods of some elements in every lane, see ReadingForm.
template <class D>
struct Products {
  hn::Vec<D> numerator;
  hn::Vec<D> denominator;
  hn::Vec<hn::RebindToUnsigned<D>> exponent;  ///< taken out, modulo the lane's range

  explicit Products(D d)
      : numerator(hn::Set(d, hn::TFromD<D>{1})),
        denominator(hn::Set(d, hn::TFromD<D>{1})),
        exponent(hn::Zero(hn::RebindToUnsigned<D>())) {}
};

template <class D>
HWY_INLINE void multiply(D d, hn::Vec<D> l, hn::Vec<D> at_negative, hn::Vec<D> at_positive,
                         Products<D>& product) {
  const auto one = hn::Set(d, hn::TFromD<D>{1});
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
  using Lane = hn::TFromD<D>;
  const hn::RebindToUnsigned<D> du;
  const auto mantissa = hn::Set(du, VectorMath<Lane>::mantissa_mask);
  const auto one = hn::Set(du, VectorMath<Lane>::one_bits);
  const auto n = hn::BitCast(du, product.numerator);
  const auto m = hn::BitCast(du, product.denominator);
  constexpr int shift = VectorMath<Lane>::mantissa_bits;
  product.exponent =
      hn::Add(product.exponent, hn::Sub(hn::ShiftRight<shift>(n), hn::ShiftRight<shift>(m)));
  product.numerator = hn::BitCast(d, hn::Or(hn::And(n, mantissa), one));
  product.denominator = hn::BitCast(d, hn::Or(hn::And(m, mantissa), one));
}

/// Sum of the logarithms of all lanes' factors.
template <class D>
void store_logs(D d, const Products<D>& product, double constant, double* log_likelihood) {
  using Lane = hn::TFromD<D>;
  const hn::RebindToUnsigned<D> du;
  const hn::ScalableTag<double> dd;
  HWY_ALIGN Lane numerator[most_lanes];
  HWY_ALIGN Lane denominator[most_lanes];
  HWY_ALIGN hn::TFromD<decltype(du)> exponent[most_lanes];
  hn::Store(product.numerator, d, numerator);
  hn::Store(product.denominator, d, denominator);
  hn::Store(product.exponent, du, exponent);
  HWY_ALIGN double over[most_lanes];
  HWY_ALIGN double under[most_lanes];
  HWY_ALIGN double power[most_lanes];
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    over[i] = static_cast<double>(numerator[i]);
    under[i] = static_cast<double>(denominator[i]);
    power[i] =
        static_cast<double>(static_cast<std::make_signed_t<hn::TFromD<decltype(du)>>>(exponent[i]));
  }
  for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(dd)) {
    const auto x = hn::Div(hn::Load(dd, over + i), hn::Load(dd, under + i));
    const auto logs =
        hn::Add(hn::Mul(hn::Load(dd, power + i), hn::Set(dd, VectorMath<double>::ln2)),
                log_near_one(dd, x));
    hn::StoreU(hn::Add(logs, hn::Set(dd, constant)), dd, log_likelihood + i);
  }
}

/// The bins of one vector, as products over the elements.
/// @param log_odds_at (element): in every lane
template <class D, class LogOddsAt>
void multiply_elements(D d, const LogOddsAt& log_odds_at, std::span<const ReadingRun> runs,
                       const ReadingForm& form, double* log_likelihood) {
  using Lane = hn::TFromD<D>;
  const int interval = sizeof(Lane) == 4 ? form.float_interval : form.double_interval;
  const auto ratio = hn::Set(d, static_cast<Lane>(form.ratio));
  const auto one = hn::Set(d, Lane{1});
  Products<D> product(d);
  int since = 0;
  for (const ReadingRun& run : runs) {
    const bool contact = run.reading != Reading::no_contact;
    const auto at_negative = contact ? ratio : one;
    const auto at_positive = contact ? one : ratio;
    for (std::size_t e = run.begin; e < run.end; ++e) {
      multiply(d, log_odds_at(e), at_negative, at_positive, product);
      if (++since == interval) {
        take_out(d, product);
        since = 0;
      }
    }
  }
  take_out(d, product);
  const std::size_t count = runs.empty() ? 0 : runs.back().end;
  store_logs(d, product, static_cast<double>(count) * form.log_scale, log_likelihood);
}

/// Adds every lane to a sum in float64.
template <class D>
HWY_INLINE void add_lanes(D d, hn::Vec<D> v, double* sums) {
  HWY_ALIGN hn::TFromD<D> lanes[most_lanes];
  hn::Store(v, d, lanes);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
    sums[i] += static_cast<double>(lanes[i]);
  }
}

/// The bins of one vector, as sums of the elements' log-likelihoods.
/// @param log_odds_at (element): in every lane
/// @param logs_of (reading): its log-likelihoods, at(d, log odds)
template <class D, class LogOddsAt, class LogsOf>
void add_elements(D d, const LogOddsAt& log_odds_at, std::span<const ReadingRun> runs,
                  const LogsOf& logs_of, double* log_likelihood) {
  constexpr bool in_parts = sizeof(hn::TFromD<D>) == 4;
  auto sum = hn::Zero(d);
  HWY_ALIGN double sums[most_lanes] = {};
  [[maybe_unused]] int together = 0;
  for (const ReadingRun& run : runs) {
    const auto logs = logs_of(run.reading);
    for (std::size_t e = run.begin; e < run.end; ++e) {
      sum = hn::Add(sum, logs.at(d, log_odds_at(e)));
      if constexpr (in_parts) {
        if (++together == floats_together) {
          add_lanes(d, sum, sums);
          sum = hn::Zero(d);
          together = 0;
        }
      }
    }
  }
  if constexpr (in_parts) {
    add_lanes(d, sum, sums);
    std::copy(sums, sums + hn::Lanes(d), log_likelihood);
  } else {
    hn::StoreU(sum, d, log_likelihood);
  }
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

/// A row of a table, in registers where these hold it: gathers are several times slower than
/// permutations.
template <class D>
class RowNumbers {
 public:
  RowNumbers(D d, const hn::TFromD<D>* row, std::size_t nodes) : row_(row) {
    if constexpr (permutes) {
      if (nodes <= parts * lanes) {
        for (std::size_t part = 0; part < parts; ++part) {
          parts_[part] = hn::LoadU(d, row + part * lanes);
        }
        in_registers_ = true;
      }
    }
  }

  template <class VI>
  HWY_INLINE hn::Vec<D> at(D d, VI index) const {
    if constexpr (permutes) {
      if (in_registers_) {
        const hn::RebindToSigned<D> di;
        const auto lane = hn::IndicesFromVec(d, hn::And(index, hn::Set(di, lanes - 1)));
        const auto odd = hn::RebindMask(d, hn::TestBit(index, hn::Set(di, lanes)));
        const auto upper = hn::RebindMask(d, hn::TestBit(index, hn::Set(di, 2 * lanes)));
        const auto part = [&](std::size_t i)
                              HWY_ATTR { return hn::TableLookupLanes(parts_[i], lane); };
        return hn::IfThenElse(upper, hn::IfThenElse(odd, part(3), part(2)),
                              hn::IfThenElse(odd, part(1), part(0)));
      }
    }
    return hn::GatherIndex(d, row_, index);
  }

 private:
  static constexpr int lanes = 16;
  static constexpr std::size_t parts = TableRows<float>::least_length / lanes;
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  static constexpr bool permutes = sizeof(hn::TFromD<D>) == 4;
#else
  static constexpr bool permutes = false;
#endif

  const hn::TFromD<D>* row_;
  bool in_registers_ = false;
  hn::Vec<D> parts_[permutes ? parts : 1];
};

/// The log-likelihoods of one reading in a table.
template <class D>
class TableRow {
  using Lane = hn::TFromD<D>;

 public:
  TableRow(D d, const ReadingForm& form, std::size_t object, Reading reading)
      : TableRow(d, form, form.rows<Lane>().values(form.row(object, reading)),
                 form.rows<Lane>().length) {}

  HWY_INLINE hn::Vec<D> at(D d, hn::Vec<D> l) const {
    const auto at = hn::Max(hn::Zero(d), hn::Min(hn::Mul(hn::Sub(l, first_), scale_), last_));
    const auto segment = hn::Min(hn::Floor(at), last_segment_);
    const auto index = whole_number(d, segment);
    return hn::Add(values_.at(d, index), hn::Mul(differences_.at(d, index), hn::Sub(at, segment)));
  }

 private:
  TableRow(D d, const ReadingForm& form, const Lane* values, std::size_t length)
      : values_(d, values, form.nodes),
        differences_(d, values + length, form.nodes),
        first_(hn::Set(d, static_cast<Lane>(form.first_log_odds))),
        scale_(hn::Set(d, static_cast<Lane>(form.nodes_per_nat))),
        last_(hn::Set(d, static_cast<Lane>(form.nodes - 1))),
        last_segment_(hn::Set(d, static_cast<Lane>(form.nodes - 2))) {}

  RowNumbers<D> values_;
  RowNumbers<D> differences_;
  hn::Vec<D> first_;
  hn::Vec<D> scale_;
  hn::Vec<D> last_;
  hn::Vec<D> last_segment_;
};

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#endif
