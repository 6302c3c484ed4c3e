// Functions of Highway's vectors of float64, for files that are compiled once for every set of
// instructions. All of them work lane by lane and fuse nothing: every set gives the same bits.

#if defined(PALPATE_VECTOR_MATH_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PALPATE_VECTOR_MATH_INL
#undef PALPATE_VECTOR_MATH_INL
#else
#define PALPATE_VECTOR_MATH_INL
#endif

#include <cstdint>
#include <iterator>

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

struct VectorMath {
  static constexpr int mantissa_bits = 52;
  static constexpr std::uint64_t mantissa_mask = 0x000FFFFFFFFFFFFF;
  static constexpr std::uint64_t one_bits = 0x3FF0000000000000;
  static constexpr double log2_e = 1.4426950408889634;
  static constexpr double ln2 = 0.6931471805599453;
  static constexpr double whole = 0x1p52;
  static constexpr double rounder = 0x1.8p52;
  static constexpr double least_exponent = -1021.0;
  /// (2^f - 1) / f over [-1/2, 1/2]; 2^f is within 7.8e-14 of itself: the positions' rounding to a
  /// grid counts for more.
  static constexpr double exp2_terms[] = {
      0.6931471805585505,     0.24022650695813708,    0.055504108739712246,
      0.009618129159172244,   0.0013333547331461978,  0.0001540345603665657,
      1.5258493063907014e-05, 1.3255182784592006e-06, 9.16811938851594e-08};
};

/// The integers that lanes hold, which are at least 0 and below 2^52.
template <class D>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> whole_number(D d, hn::Vec<D> v) {
  const hn::RebindToSigned<D> di;
  // Below the leading bit of 2^52 stands the integer.
  const auto bits = hn::BitCast(di, hn::Add(v, hn::Set(d, VectorMath::whole)));
  return hn::And(bits, hn::Set(di, static_cast<std::int64_t>(VectorMath::mantissa_mask)));
}

/// exp(-v) for v >= 0, by powers of two and a polynomial; at least about 2^-1021.
template <class D>
HWY_INLINE hn::Vec<D> exp_of_minus(D d, hn::Vec<D> v) {
  using Math = VectorMath;
  const hn::RebindToUnsigned<D> du;
  const auto exponent =
      hn::Max(hn::Mul(v, hn::Set(d, -Math::log2_e)), hn::Set(d, Math::least_exponent));
  // The nearest integer stands in the last bits of `rounded`.
  const auto rounded = hn::Add(exponent, hn::Set(d, Math::rounder));
  const auto f = hn::Sub(exponent, hn::Sub(rounded, hn::Set(d, Math::rounder)));
  constexpr int terms = static_cast<int>(std::size(Math::exp2_terms));
  auto p = hn::Set(d, Math::exp2_terms[terms - 1]);
  for (int k = terms - 2; k >= 0; --k) {
    p = hn::Add(hn::Mul(p, f), hn::Set(d, Math::exp2_terms[k]));
  }
  p = hn::Add(hn::Mul(p, f), hn::Set(d, 1.0));
  const auto power = hn::ShiftLeft<Math::mantissa_bits>(hn::BitCast(du, rounded));
  return hn::BitCast(d, hn::Add(hn::BitCast(du, p), power));
}

/// log(v) for v within (1/2, 2): 2 atanh((v - 1) / (v + 1)), after halving or doubling v where that
/// brings it nearer 1.
template <class D>
HWY_INLINE hn::Vec<D> log_near_one(D d, hn::Vec<D> v) {
  const auto one = hn::Set(d, 1.0);
  const auto ln2 = hn::Set(d, VectorMath::ln2);
  const auto large = hn::Gt(v, hn::Set(d, 1.4142135623730951));
  const auto small = hn::Lt(v, hn::Set(d, 0.7071067811865476));
  v = hn::IfThenElse(large, hn::Mul(v, hn::Set(d, 0.5)), v);
  v = hn::IfThenElse(small, hn::Add(v, v), v);
  const auto power = hn::Sub(hn::IfThenElseZero(large, ln2), hn::IfThenElseZero(small, ln2));
  const auto s = hn::Div(hn::Sub(v, one), hn::Add(v, one));
  // |s| < 0.172: the series' rest is below 1e-17 of it.
  const auto square = hn::Mul(s, s);
  auto sum = hn::Set(d, 1.0 / 21.0);
  for (int k = 19; k >= 1; k -= 2) {
    sum = hn::Add(hn::Mul(sum, square), hn::Set(d, 1.0 / k));
  }
  return hn::Add(power, hn::Mul(hn::Add(s, s), sum));
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#endif
