// Bilinear interpolation between the nodes of MapPatches, for files that are compiled once for
// every set of instructions.

#if defined(PALPATE_PATCH_INTERPOLATION_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef PALPATE_PATCH_INTERPOLATION_INL
#undef PALPATE_PATCH_INTERPOLATION_INL
#else
#define PALPATE_PATCH_INTERPOLATION_INL
#endif

#include <cstddef>
#include <cstdint>

#include <hwy/highway.h>

#include "bin_kernel.hpp"
#include "map_patches.hpp"
#include "vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

/// Reads one node of a patch for every lane. `from` is the patch, or the patch moved to another
/// corner of the cells; `index`, below 11, is that of the cell's first node.
template <class DF, class VI>
HWY_INLINE hn::Vec<DF> look_up(DF df, const float* from, VI index) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  // Gathers are several times slower than a permutation of the 16 nodes.
  const hn::Full512<float> whole;
  const auto nodes = hn::LoadU(whole, from);
  if constexpr (hn::MaxLanes(DF()) == 16) {
    return hn::TableLookupLanes(nodes, hn::IndicesFromVec(whole, index));
  } else {
    const hn::Full512<std::int32_t> whole_index;
    const auto wide = hn::ZeroExtendVector(whole_index, index);
    return hn::LowerHalf(df, hn::TableLookupLanes(nodes, hn::IndicesFromVec(whole, wide)));
  }
#elif HWY_TARGET == HWY_AVX2
  const hn::Full256<float> whole;
  const hn::Full256<std::int32_t> whole_index;
  const auto low_nodes = hn::LoadU(whole, from);
  const auto high_nodes = hn::LoadU(whole, from + 8);
  const auto both = [&](auto wide) HWY_ATTR {
    const auto lane = hn::IndicesFromVec(whole, hn::And(wide, hn::Set(whole_index, 7)));
    const auto is_high = hn::BitCast(whole, hn::ShiftLeft<28>(wide));
    return hn::IfNegativeThenElse(is_high, hn::TableLookupLanes(high_nodes, lane),
                                  hn::TableLookupLanes(low_nodes, lane));
  };
  if constexpr (hn::MaxLanes(DF()) == 8) {
    return both(index);
  } else {
    return hn::LowerHalf(df, both(hn::ZeroExtendVector(whole_index, index)));
  }
#elif HWY_TARGET == HWY_SCALAR
  return hn::GatherIndex(df, from, index);
#else
  // A vector holds a column's nodes; an index is that of one of the first three columns.
  const hn::Full128<float> whole;
  const hn::Full128<std::int32_t> whole_index;
  const auto all = [&](auto wide) HWY_ATTR {
    const auto lane = hn::IndicesFromVec(whole, hn::And(wide, hn::Set(whole_index, 3)));
    const auto in_column = [&](int column) HWY_ATTR {
      return hn::TableLookupLanes(hn::LoadU(whole, from + MapPatches::side * column), lane);
    };
    // Whole masks: IfNegativeThenElse() of Highway 1.0.3 needs them too with SSSE3.
    const auto second =
        hn::RebindMask(whole, hn::TestBit(wide, hn::Set(whole_index, MapPatches::side)));
    const auto third =
        hn::RebindMask(whole, hn::TestBit(wide, hn::Set(whole_index, 2 * MapPatches::side)));
    return hn::IfThenElse(third, in_column(2), hn::IfThenElse(second, in_column(1), in_column(0)));
  };
  if constexpr (hn::MaxLanes(DF()) == 4) {
    return all(index);
  } else {
    return hn::LowerHalf(df, all(hn::Combine(whole_index, index, index)));
  }
#endif
}

/// As look_up(), in the lanes' numbers. In float64, where nodes of the border are among the
/// patch's, puts the exact prior in the place of its marker.
template <bool with_border, class D, class VI>
HWY_INLINE hn::Vec<D> node(D d, const MapPatches& map, const float* from, VI index) {
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return look_up(d, from, index);
  } else {
    const auto stored = hn::PromoteTo(d, look_up(hn::Rebind<float, D>(), from, index));
    if constexpr (!with_border) {
      return stored;
    }
    const auto marker = hn::Set(d, static_cast<double>(map.marker()));
    return hn::IfThenElse(hn::Eq(stored, marker), hn::Set(d, map.prior_log_odds()), stored);
  }
}

/// Between the nodes of a cell: the first of a name is its column, the second its row.
template <class V>
HWY_INLINE V bilinear(V v00, V v01, V v10, V v11, V fx, V fy) {
  const auto left = hn::Add(v00, hn::Mul(hn::Sub(v01, v00), fy));
  const auto right = hn::Add(v10, hn::Mul(hn::Sub(v11, v10), fy));
  return hn::Add(left, hn::Mul(hn::Sub(right, left), fx));
}

template <bool with_border, class D>
HWY_INLINE hn::Vec<D> interpolate(D d, const MapPatches& map, std::int32_t patch, hn::Vec<D> x,
                                  hn::Vec<D> y) {
  const float* const from = map.nodes() + MapPatches::side * static_cast<std::size_t>(patch);
  const auto column = hn::Floor(x);
  const auto row = hn::Floor(y);
  const auto fx = hn::Sub(x, column);
  const auto fy = hn::Sub(y, row);
  const auto index = small_integer(d, hn::Add(hn::Mul(column, hn::Set(d, hn::TFromD<D>{4})), row));
  const auto v00 = node<with_border>(d, map, from, index);
  const auto v01 = node<with_border>(d, map, from + 1, index);
  const auto v10 = node<with_border>(d, map, from + MapPatches::side, index);
  const auto v11 = node<with_border>(d, map, from + MapPatches::side + 1, index);
  return bilinear(v00, v01, v10, v11, fx, fy);
}

/// Log odds at an element, for bins that lie `x`, `y` cells from the block's first bin.
template <class D, typename Lane>
HWY_INLINE hn::Vec<D> log_odds(D d, const MapPatches& map, const ElementPatches<Lane>& elements,
                               std::size_t e, hn::Vec<D> x, hn::Vec<D> y) {
  const std::int32_t patch = elements.patch[e];
  const auto in_patch_x = hn::Add(hn::Set(d, elements.x[e]), x);
  const auto in_patch_y = hn::Add(hn::Set(d, elements.y[e]), y);
  // Few patches have nodes of the border: seldom is the branch mispredicted.
  if (sizeof(Lane) == 4 || patch >= 0) {
    return interpolate<false>(d, map, patch, in_patch_x, in_patch_y);
  }
  return interpolate<true>(d, map, ~patch, in_patch_x, in_patch_y);
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#endif
