// The likelihood of bins: by Eq. 7 as products over the elements (ReadingForm), or by a table over
// log odds. For files that are compiled once for every set of instructions.

#if defined(PALPATE_READING_LIKELIHOOD_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PALPATE_READING_LIKELIHOOD_INL
#undef PALPATE_READING_LIKELIHOOD_INL
#else
#define PALPATE_READING_LIKELIHOOD_INL
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
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
  hn::Vec<D> sum;                             ///< of a, since it was last taken out

  explicit Products(D d)
      : numerator(hn::Set(d, hn::TFromD<D>{1})),
        denominator(hn::Set(d, hn::TFromD<D>{1})),
        exponent(hn::Zero(hn::RebindToUnsigned<D>())),
        sum(hn::Zero(d)) {}
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

/// Multiplies as multiply() does, with a sum beside the product, for log odds `z` of the reading.
template <class D>
HWY_INLINE void multiply_and_add(D d, hn::Vec<D> z, hn::Vec<D> log_ratio, Products<D>& product) {
  const auto one = hn::Set(d, hn::TFromD<D>{1});
  const auto zero = hn::Zero(d);
  const auto e = exp_of_minus(d, hn::Abs(z));
  const auto a = hn::Max(hn::Min(z, zero), log_ratio);
  const auto other = exp_of_minus(d, hn::Abs(hn::Sub(hn::Min(z, zero), log_ratio)));
  const auto factor = hn::IfThenElse(hn::Lt(z, zero), one, e);
  product.numerator = hn::Mul(product.numerator, hn::Add(one, hn::Mul(other, factor)));
  product.denominator = hn::Mul(product.denominator, hn::Add(one, e));
  product.sum = hn::Add(product.sum, a);
}

/// Takes powers of two, and the sum, out of the product.
template <class D>
HWY_INLINE void take_out(D d, Products<D>& product, double* sums) {
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
  if (sums != nullptr) {
    HWY_ALIGN Lane sum[most_lanes];
    hn::Store(product.sum, d, sum);
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      sums[i] += static_cast<double>(sum[i]);
    }
    product.sum = hn::Zero(d);
  }
}

/// Sum of the logarithms of all lanes' factors.
template <class D>
void store_logs(D d, const Products<D>& product, const double* sums, double constant,
                double* log_likelihood) {
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
    const auto rest = hn::Add(hn::LoadU(dd, sums + i), hn::Set(dd, constant));
    hn::StoreU(hn::Add(logs, rest), dd, log_likelihood + i);
  }
}

/// The bins of one vector, by Eq. 7.
/// @param log_odds_at (element): in every lane
template <ReadingForm::Kind kind, class D, class LogOddsAt>
void evaluate_lanes(D d, const LogOddsAt& log_odds_at, std::span<const ReadingRun> runs,
                    const ReadingForm& form, double* log_likelihood) {
  using Lane = hn::TFromD<D>;
  constexpr bool in_sums = kind == ReadingForm::Kind::sums;
  const int interval = sizeof(Lane) == 4 ? form.float_interval : form.double_interval;
  const auto ratio = hn::Set(d, static_cast<Lane>(form.ratio));
  const auto log_ratio = hn::Set(d, static_cast<Lane>(form.log_ratio));
  const auto one = hn::Set(d, Lane{1});
  Products<D> product(d);
  HWY_ALIGN double sums[most_lanes] = {};
  std::size_t count = 0;
  int since = 0;
  for (const ReadingRun& run : runs) {
    const bool contact = run.reading != Reading::no_contact;
    const auto at_negative = contact ? ratio : one;
    const auto at_positive = contact ? one : ratio;
    count += run.end - run.begin;
    for (std::size_t e = run.begin; e < run.end; ++e) {
      const auto l = log_odds_at(e);
      if constexpr (in_sums) {
        multiply_and_add(d, contact ? l : hn::Neg(l), log_ratio, product);
      } else {
        multiply(d, l, at_negative, at_positive, product);
      }
      if (++since == interval) {
        take_out(d, product, in_sums ? sums : nullptr);
        since = 0;
      }
    }
  }
  take_out(d, product, in_sums ? sums : nullptr);
  store_logs(d, product, sums, static_cast<double>(count) * form.log_scale, log_likelihood);
}

/// The log-likelihoods of one reading in a table.
template <class D>
class TableRow {
 public:
  TableRow(D d, const ReadingForm& form, std::size_t object, Reading reading)
      : row_(form.row(object, reading)),
        first_(hn::Set(d, form.first_log_odds)),
        scale_(hn::Set(d, form.nodes_per_nat)),
        last_(hn::Set(d, static_cast<double>(form.nodes - 1))),
        last_segment_(hn::Set(d, static_cast<double>(form.nodes - 2))) {}

  HWY_INLINE hn::Vec<D> at(D d, hn::Vec<D> l) const {
    const auto at = hn::Max(hn::Zero(d), hn::Min(hn::Mul(hn::Sub(l, first_), scale_), last_));
    const auto segment = hn::Min(hn::Floor(at), last_segment_);
    const auto index =
        hn::BitCast(hn::RebindToSigned<D>(), whole_number(d, hn::Add(segment, segment)));
    const auto value = hn::GatherIndex(d, row_, index);
    const auto difference = hn::GatherIndex(d, row_ + 1, index);
    return hn::Add(value, hn::Mul(difference, hn::Sub(at, segment)));
  }

 private:
  const double* row_;
  hn::Vec<D> first_;
  hn::Vec<D> scale_;
  hn::Vec<D> last_;
  hn::Vec<D> last_segment_;
};

/// The bins of one vector, by a table of log-likelihoods.
/// @param log_odds_at (element): in every lane
template <class D, class LogOddsAt>
void look_up_lanes(D d, const LogOddsAt& log_odds_at, std::size_t object,
                   std::span<const ReadingRun> runs, const ReadingForm& form,
                   double* log_likelihood) {
  auto sum = hn::Zero(d);
  for (const ReadingRun& run : runs) {
    const TableRow table(d, form, object, run.reading);
    for (std::size_t e = run.begin; e < run.end; ++e) {
      sum = hn::Add(sum, table.at(d, log_odds_at(e)));
    }
  }
  hn::StoreU(sum, d, log_likelihood);
}

/// The only bin of a block, by a table: a vector holds elements. The bits are look_up_lanes()'s.
/// @param elements padded; x is overwritten
template <class D>
void look_up_elements(D d, const MapPatches& map, std::size_t object,
                      ElementPatches<double>& elements, std::span<const ReadingRun> runs,
                      const ReadingForm& form, double* log_likelihood) {
  const hn::Rebind<std::int32_t, D> di;
  const hn::Rebind<float, D> df;
  const auto marker = hn::Set(d, static_cast<double>(map.marker()));
  const auto prior = hn::Set(d, map.prior_log_odds());
  double* const values = elements.x.data();
  for (std::size_t e = 0; e < elements.x.size(); e += hn::Lanes(d)) {
    const auto stored = hn::LoadU(di, elements.patch.data() + e);
    const auto patch = hn::IfThenElse(hn::Lt(stored, hn::Zero(di)), hn::Not(stored), stored);
    static_assert(MapPatches::side == 4);
    const auto first = hn::ShiftLeft<2>(patch);
    const auto node = [&](int index) HWY_ATTR {
      const auto of_map = hn::PromoteTo(d, hn::GatherIndex(df, map.nodes() + index, first));
      return hn::IfThenElse(hn::Eq(of_map, marker), prior, of_map);
    };
    const auto l =
        bilinear(node(0), node(1), node(MapPatches::side), node(MapPatches::side + 1),
                 hn::LoadU(d, elements.x.data() + e), hn::LoadU(d, elements.y.data() + e));
    hn::StoreU(l, d, values + e);
  }
  double sum = 0.0;
  for (const ReadingRun& run : runs) {
    const TableRow table(d, form, object, run.reading);
    std::size_t e = run.begin;
    for (; e + hn::Lanes(d) <= run.end; e += hn::Lanes(d)) {
      hn::StoreU(table.at(d, hn::LoadU(d, values + e)), d, values + e);
    }
    if (e < run.end) {
      HWY_ALIGN double rest[most_lanes] = {};
      std::copy(values + e, values + run.end, rest);
      hn::Store(table.at(d, hn::Load(d, rest)), d, rest);
      std::copy(rest, rest + (run.end - e), values + e);
    }
    sum = std::accumulate(values + run.begin, values + run.end, sum);
  }
  *log_likelihood = sum;
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#endif
