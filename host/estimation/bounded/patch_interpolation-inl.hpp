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
#include <span>

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

/// The lanes of a vector whose bins belong to one block, and the elements about this block.
template <class D>
struct LanesOfBlock {
  const ElementPatches<hn::TFromD<D>>* elements;
  hn::Mask<D> lanes;
  hn::Mask<hn::Rebind<float, D>> float_lanes;
};

/// Between the nodes of a cell: the first of a name is its column, the second its row.
template <class V>
HWY_INLINE V bilinear(V v00, V v01, V v10, V v11, V fx, V fy) {
  const auto left = hn::Add(v00, hn::Mul(hn::Sub(v01, v00), fy));
  const auto right = hn::Add(v10, hn::Mul(hn::Sub(v11, v10), fy));
  return hn::Add(left, hn::Mul(hn::Sub(right, left), fx));
}

/// Interpolates between nodes that look_up(offset, index) reads, the nodes of a patch being
/// numbered from its first corner column by column. In float64, where nodes of the border are among
/// the patch's, puts the exact prior in the place of its marker.
/// @param x, y places within the patch
template <class D, class LookUp>
HWY_INLINE hn::Vec<D> interpolate(D d, const MapPatches& map, hn::Vec<D> x, hn::Vec<D> y,
                                  bool with_border, const LookUp& look_up) {
  const auto column = hn::Floor(x);
  const auto row = hn::Floor(y);
  const auto fx = hn::Sub(x, column);
  const auto fy = hn::Sub(y, row);
  const auto index = small_integer(d, hn::Add(hn::Mul(column, hn::Set(d, hn::TFromD<D>{4})), row));
  const auto v00 = look_up(0, index);
  const auto v01 = look_up(1, index);
  const auto v10 = look_up(MapPatches::side, index);
  const auto v11 = look_up(MapPatches::side + 1, index);
  if constexpr (sizeof(hn::TFromD<D>) == 4) {
    return bilinear(v00, v01, v10, v11, fx, fy);
  } else {
    const auto w00 = hn::PromoteTo(d, v00);
    const auto w01 = hn::PromoteTo(d, v01);
    const auto w10 = hn::PromoteTo(d, v10);
    const auto w11 = hn::PromoteTo(d, v11);
    // Few patches have nodes of the border: seldom is the branch mispredicted.
    if (!with_border) {
      return bilinear(w00, w01, w10, w11, fx, fy);
    }
    const auto marker = hn::Set(d, static_cast<double>(map.marker()));
    const auto prior = hn::Set(d, map.prior_log_odds());
    const auto unmarked = [&](hn::Vec<D> v)
                              HWY_ATTR { return hn::IfThenElse(hn::Eq(v, marker), prior, v); };
    return bilinear(unmarked(w00), unmarked(w01), unmarked(w10), unmarked(w11), fx, fy);
  }
}

/// The first node of a patch, see ElementPatches::patch.
inline const float* nodes_of(const MapPatches& map, std::int32_t patch) {
  return map.nodes() + MapPatches::side * static_cast<std::size_t>(patch >= 0 ? patch : ~patch);
}

/// Log odds at an element, for bins of one block that lie `x`, `y` cells from its first bin.
template <class D, typename Lane>
HWY_INLINE hn::Vec<D> log_odds(D d, const MapPatches& map, const ElementPatches<Lane>& elements,
                               std::size_t e, hn::Vec<D> x, hn::Vec<D> y) {
  const std::int32_t patch = elements.patch[e];
  const float* const nodes = nodes_of(map, patch);
  return interpolate(d, map, hn::Add(hn::Set(d, elements.x[e]), x),
                     hn::Add(hn::Set(d, elements.y[e]), y), patch < 0,
                     [&](int offset, auto index) HWY_ATTR {
                       return look_up(hn::Rebind<float, D>(), nodes + offset, index);
                     });
}

/// The same for bins of several blocks.
/// @param parts at least one; the first has all lanes, and each later one takes its own from those
/// before it
template <class D>
HWY_INLINE hn::Vec<D> log_odds(D d, const MapPatches& map, std::span<const LanesOfBlock<D>> parts,
                               std::size_t e, hn::Vec<D> x, hn::Vec<D> y) {
  const hn::Rebind<float, D> df;
  const ElementPatches<hn::TFromD<D>>& first = *parts.front().elements;
  const float* nodes[most_lanes];
  nodes[0] = nodes_of(map, first.patch[e]);
  bool with_border = first.patch[e] < 0;
  auto from_x = hn::Set(d, first.x[e]);
  auto from_y = hn::Set(d, first.y[e]);
  for (std::size_t p = 1; p < parts.size(); ++p) {
    const ElementPatches<hn::TFromD<D>>& elements = *parts[p].elements;
    nodes[p] = nodes_of(map, elements.patch[e]);
    with_border = with_border || elements.patch[e] < 0;
    from_x = hn::IfThenElse(parts[p].lanes, hn::Set(d, elements.x[e]), from_x);
    from_y = hn::IfThenElse(parts[p].lanes, hn::Set(d, elements.y[e]), from_y);
  }
  return interpolate(d, map, hn::Add(from_x, x), hn::Add(from_y, y), with_border,
                     [&](int offset, auto index) HWY_ATTR {
                       auto found = look_up(df, nodes[0] + offset, index);
                       for (std::size_t p = 1; p < parts.size(); ++p) {
                         found = hn::IfThenElse(parts[p].float_lanes,
                                                look_up(df, nodes[p] + offset, index), found);
                       }
                       return found;
                     });
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#endif
