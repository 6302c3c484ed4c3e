// Bilinear interpolation between the nodes of MapPatches, for files that are compiled once for
// every set of instructions.

#include <cstddef>
#include <cstdint>

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

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();
