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

/// The nodes of a patch, in registers where these hold them: gathers are several times slower than
/// permutations.
class PatchNodes {
 public:
  explicit HWY_INLINE PatchNodes(const float* patch);

  /// The node `offset`, of the corners of a cell, after that of `index` in every lane. `index`,
  /// below 11, is that of the cell's first node.
  template <class DF, class VI>
  HWY_INLINE hn::Vec<DF> at(DF df, VI index, int offset) const;

 private:
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  hn::Vec<hn::Full512<float>> nodes_;
#elif HWY_TARGET == HWY_AVX2
  hn::Vec<hn::Full256<float>> low_;
  hn::Vec<hn::Full256<float>> high_;
#else
  const float* patch_;
#endif
};

#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL

HWY_INLINE PatchNodes::PatchNodes(const float* patch)
    : nodes_(hn::LoadU(hn::Full512<float>(), patch)) {}

template <class DF, class VI>
HWY_INLINE hn::Vec<DF> PatchNodes::at(DF df, VI index, int offset) const {
  const hn::Full512<float> whole;
  const hn::Full512<std::int32_t> whole_index;
  const auto wide = hn::ZeroExtendVector(whole_index, index);
  const auto lane = hn::Add(wide, hn::Set(whole_index, offset));
  return hn::LowerHalf(df, hn::TableLookupLanes(nodes_, hn::IndicesFromVec(whole, lane)));
}

#elif HWY_TARGET == HWY_AVX2

HWY_INLINE PatchNodes::PatchNodes(const float* patch)
    : low_(hn::LoadU(hn::Full256<float>(), patch)),
      high_(hn::LoadU(hn::Full256<float>(), patch + 8)) {}

template <class DF, class VI>
HWY_INLINE hn::Vec<DF> PatchNodes::at(DF df, VI index, int offset) const {
  const hn::Full256<float> whole;
  const hn::Full256<std::int32_t> whole_index;
  const auto node = hn::Add(hn::ZeroExtendVector(whole_index, index), hn::Set(whole_index, offset));
  const auto lane = hn::IndicesFromVec(whole, hn::And(node, hn::Set(whole_index, 7)));
  const auto is_high = hn::BitCast(whole, hn::ShiftLeft<28>(node));
  return hn::LowerHalf(df, hn::IfNegativeThenElse(is_high, hn::TableLookupLanes(high_, lane),
                                                  hn::TableLookupLanes(low_, lane)));
}

#else

HWY_INLINE PatchNodes::PatchNodes(const float* patch) : patch_(patch) {}

template <class DF, class VI>
HWY_INLINE hn::Vec<DF> PatchNodes::at(DF df, VI index, int offset) const {
  return hn::GatherIndex(df, patch_ + offset, index);
}

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

/// Interpolates between the corners that corners_at(index) reads, the nodes of a patch being
/// numbered from its first corner column by column. Where nodes of the border are among the
/// patch's, puts the exact prior in the place of its marker.
/// @param x, y places within the patch
template <class D, class CornersAt>
HWY_INLINE hn::Vec<D> interpolate(D d, const MapPatches& map, hn::Vec<D> x, hn::Vec<D> y,
                                  bool with_border, const CornersAt& corners_at) {
  const auto column = hn::Floor(x);
  const auto row = hn::Floor(y);
  const auto fx = hn::Sub(x, column);
  const auto fy = hn::Sub(y, row);
  const hn::Rebind<std::int32_t, D> di;
  const auto index =
      hn::DemoteTo(di, hn::Add(hn::Mul(column, hn::Set(d, double{MapPatches::side})), row));
  const auto c = corners_at(index);
  const auto w00 = hn::PromoteTo(d, c.v00);
  const auto w01 = hn::PromoteTo(d, c.v01);
  const auto w10 = hn::PromoteTo(d, c.v10);
  const auto w11 = hn::PromoteTo(d, c.v11);
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

/// The first node of a patch, see ElementPatches::patch.
inline const float* nodes_of(const MapPatches& map, std::int32_t patch) {
  return map.nodes() + MapPatches::side * static_cast<std::size_t>(patch >= 0 ? patch : ~patch);
}

/// Log odds at an element, for bins of some blocks that lie `x`, `y` cells from their block's first
/// bin.
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
  return interpolate(d, map, hn::Add(from_x, x), hn::Add(from_y, y), with_border,
                     [&](auto index) HWY_ATTR {
                       auto found = corners_of(df, nodes[0], index);
                       for (std::size_t p = 1; p < count; ++p) {
                         const auto own = corners_of(df, nodes[p], index);
                         const auto& lanes = parts[p].float_lanes;
                         found.v00 = hn::IfThenElse(lanes, own.v00, found.v00);
                         found.v01 = hn::IfThenElse(lanes, own.v01, found.v01);
                         found.v10 = hn::IfThenElse(lanes, own.v10, found.v10);
                         found.v11 = hn::IfThenElse(lanes, own.v11, found.v11);
                       }
                       return found;
                     });
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();
