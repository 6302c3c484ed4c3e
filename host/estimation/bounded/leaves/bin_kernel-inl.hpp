// The likelihood of bins, for files that are compiled once for every set of instructions: log odds
// by bilinear interpolation between the nodes of MapPatches; and of these, by Eq. 7, products over
// the elements (ReadingForm), or sums of the elements' logs.

#include <cstddef>
#include <cstdint>
#include <span>

#include <hwy/highway.h>

#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

// The nodes of a patch, in registers where these hold them: gathers are several times slower than
// permutations.
//
//   at(df, index, offset)   the node `offset`, of the corners of a cell, after that of `index` in
//                           every lane; `index`, below 11, is that of the cell's first node

#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL

class PatchNodes {
 public:
  explicit HWY_INLINE PatchNodes(const float* patch)
      : nodes_(hn::LoadU(hn::Full512<float>(), patch)) {}

  template <class DF, class VI>
  HWY_INLINE hn::Vec<DF> at(DF df, VI index, int offset) const {
    const hn::Full512<float> whole;
    const hn::Full512<std::int32_t> whole_index;
    const auto wide = hn::ZeroExtendVector(whole_index, index);
    const auto lane = hn::Add(wide, hn::Set(whole_index, offset));
    return hn::LowerHalf(df, hn::TableLookupLanes(nodes_, hn::IndicesFromVec(whole, lane)));
  }

 private:
  hn::Vec<hn::Full512<float>> nodes_;
};

#elif HWY_TARGET == HWY_AVX2

class PatchNodes {
 public:
  explicit HWY_INLINE PatchNodes(const float* patch)
      : low_(hn::LoadU(hn::Full256<float>(), patch)),
        high_(hn::LoadU(hn::Full256<float>(), patch + 8)) {}

  template <class DF, class VI>
  HWY_INLINE hn::Vec<DF> at(DF df, VI index, int offset) const {
    const hn::Full256<float> whole;
    const hn::Full256<std::int32_t> whole_index;
    const auto node =
        hn::Add(hn::ZeroExtendVector(whole_index, index), hn::Set(whole_index, offset));
    const auto lane = hn::IndicesFromVec(whole, hn::And(node, hn::Set(whole_index, 7)));
    const auto is_high = hn::BitCast(whole, hn::ShiftLeft<28>(node));
    return hn::LowerHalf(df, hn::IfNegativeThenElse(is_high, hn::TableLookupLanes(high_, lane),
                                                    hn::TableLookupLanes(low_, lane)));
  }

 private:
  hn::Vec<hn::Full256<float>> low_;
  hn::Vec<hn::Full256<float>> high_;
};

#else

class PatchNodes {
 public:
  explicit HWY_INLINE PatchNodes(const float* patch) : patch_(patch) {}

  template <class DF, class VI>
  HWY_INLINE hn::Vec<DF> at(DF df, VI index, int offset) const {
    return hn::GatherIndex(df, patch_ + offset, index);
  }

 private:
  const float* patch_;
};

#endif

/// The lanes of a vector whose bins belong to one block, and the elements about this block.
template <class D>
struct LanesOfBlock {
  using Mask = hn::Mask<D>;
  using FloatMask = hn::Mask<hn::Rebind<float, D>>;

  // GCC compiles constructors that it makes itself without the instructions that masks of NEON
  // need.
  HWY_ATTR LanesOfBlock() {}
  HWY_ATTR LanesOfBlock(const ElementPatches* of, Mask all, FloatMask float_all)
      : elements(of), lanes(all), float_lanes(float_all) {}

  const ElementPatches* elements = nullptr;
  Mask lanes;
  FloatMask float_lanes;
};

/// Between the nodes of a cell: the first of a name is its column, the second its row.
template <class V>
HWY_INLINE V bilinear(V v00, V v01, V v10, V v11, V fx, V fy) {
  const auto left = hn::Add(v00, hn::Mul(hn::Sub(v01, v00), fy));
  const auto right = hn::Add(v10, hn::Mul(hn::Sub(v11, v10), fy));
  return hn::Add(left, hn::Mul(hn::Sub(right, left), fx));
}

/// The nodes at the corners of a cell in every lane, named as those of bilinear().
template <class V>
struct Corners {
  V v00;
  V v01;
  V v10;
  V v11;
};

/// Reads the corners of a patch's cells.
/// @param index of each cell's first node
template <class DF, class VI>
HWY_INLINE Corners<hn::Vec<DF>> corners_of(DF df, const float* patch, VI index) {
  constexpr int side = MapPatches::side;
  const PatchNodes nodes(patch);
  return {nodes.at(df, index, 0), nodes.at(df, index, 1), nodes.at(df, index, side),
          nodes.at(df, index, side + 1)};
}

/// The first node of a patch, see ElementPatches::patch.
inline const float* nodes_of(const MapPatches& map, std::int32_t patch) {
  return map.nodes() + MapPatches::side * static_cast<std::size_t>(patch >= 0 ? patch : ~patch);
}

/// Log odds at an element, for bins of some blocks that lie `x`, `y` cells from their block's first
/// bin: interpolated between nodes, which are numbered from a patch's first corner column by
/// column. Where nodes of the border are among a patch's, puts the exact prior in the place of its
/// marker.
/// @param parts at least one; the first has all lanes, and each later one takes its own from those
/// before it
/// @param count of parts; of a single one a constant, so that the loops over parts vanish
template <class D, class Count>
HWY_INLINE hn::Vec<D> log_odds(D d, const MapPatches& map, const LanesOfBlock<D>* parts,
                               Count count, std::size_t e, hn::Vec<D> x, hn::Vec<D> y) {
  const hn::Rebind<float, D> df;
  const ElementPatches& first = *parts[0].elements;
  const float* nodes[most_lanes];
  nodes[0] = nodes_of(map, first.patch[e]);
  bool with_border = first.patch[e] < 0;
  auto from_x = hn::Set(d, first.x[e]);
  auto from_y = hn::Set(d, first.y[e]);
  for (std::size_t p = 1; p < count; ++p) {
    const ElementPatches& elements = *parts[p].elements;
    nodes[p] = nodes_of(map, elements.patch[e]);
    with_border = with_border || elements.patch[e] < 0;
    from_x = hn::IfThenElse(parts[p].lanes, hn::Set(d, elements.x[e]), from_x);
    from_y = hn::IfThenElse(parts[p].lanes, hn::Set(d, elements.y[e]), from_y);
  }
  const auto at_x = hn::Add(from_x, x);
  const auto at_y = hn::Add(from_y, y);
  const auto column = hn::Floor(at_x);
  const auto row = hn::Floor(at_y);
  const auto fx = hn::Sub(at_x, column);
  const auto fy = hn::Sub(at_y, row);
  const hn::Rebind<std::int32_t, D> di;
  const auto index =
      hn::DemoteTo(di, hn::Add(hn::Mul(column, hn::Set(d, double{MapPatches::side})), row));
  auto corners = corners_of(df, nodes[0], index);
  for (std::size_t p = 1; p < count; ++p) {
    const auto own = corners_of(df, nodes[p], index);
    const auto& lanes = parts[p].float_lanes;
    corners.v00 = hn::IfThenElse(lanes, own.v00, corners.v00);
    corners.v01 = hn::IfThenElse(lanes, own.v01, corners.v01);
    corners.v10 = hn::IfThenElse(lanes, own.v10, corners.v10);
    corners.v11 = hn::IfThenElse(lanes, own.v11, corners.v11);
  }
  const auto w00 = hn::PromoteTo(d, corners.v00);
  const auto w01 = hn::PromoteTo(d, corners.v01);
  const auto w10 = hn::PromoteTo(d, corners.v10);
  const auto w11 = hn::PromoteTo(d, corners.v11);
  // Few patches have nodes of the border: seldom is the branch mispredicted.
  if (!with_border) {
    return bilinear(w00, w01, w10, w11, fx, fy);
  }
  const auto marker = hn::Set(d, double{MapPatches::marker});
  const auto prior = hn::Set(d, map.prior_log_odds());
  const auto unmarked = [&](hn::Vec<D> v)
                            HWY_ATTR { return hn::IfThenElse(hn::Eq(v, marker), prior, v); };
  return bilinear(unmarked(w00), unmarked(w01), unmarked(w10), unmarked(w11), fx, fy);
}

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
      : values_(numbers_of(form.table, reading, object).data()),
        first_(hn::Set(d, form.table.first_log_odds)),
        scale_(hn::Set(d, form.nodes_per_nat)),
        last_(hn::Set(d, static_cast<double>(form.table.nodes - 1))),
        last_segment_(hn::Set(d, static_cast<double>(form.table.nodes - 2))) {}

  HWY_INLINE hn::Vec<D> at(D d, hn::Vec<D> l) const {
    const auto at = hn::Max(hn::Zero(d), hn::Min(hn::Mul(hn::Sub(l, first_), scale_), last_));
    const auto segment = hn::Min(hn::Floor(at), last_segment_);
    const auto index = whole_number(d, segment);
    const auto value = hn::GatherIndex(d, values_, index);
    const auto difference = hn::Sub(hn::GatherIndex(d, values_ + 1, index), value);
    return hn::Add(value, hn::Mul(difference, hn::Sub(at, segment)));
  }

 private:
  const double* values_;
  hn::Vec<D> first_;
  hn::Vec<D> scale_;
  hn::Vec<D> last_;
  hn::Vec<D> last_segment_;
};

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();
