// Highway compiles this file once for every set of vector instructions. Products and sums are never
// fused, so that every set gives the same bits.
#include "estimation/bounded/tables/window_table.hpp"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimation/bounded/tables/tile_penalties.cpp"
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace palpate::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void PlaceWindows(std::span<const glm::dvec2> from_pivot_mm, const TilePlace& place,
                  const WindowTable& shape, WindowPlaces& placed) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  // Squares that are told apart; farther elements see only the prior as well.
  const auto farthest = hn::Set(d, static_cast<double>(1 << 28));
  const auto nearest = hn::Set(d, -static_cast<double>(1 << 28));
  const glm::dvec2& square = place.square_mm;
  const auto cx = hn::Set(d, place.turn.x / square.x);
  const auto sx = hn::Set(d, place.turn.y / square.x);
  const auto cy = hn::Set(d, place.turn.x / square.y);
  const auto sy = hn::Set(d, place.turn.y / square.y);
  const auto x0 = hn::Set(d, place.corner_mm.x / square.x);
  const auto y0 = hn::Set(d, place.corner_mm.y / square.y);
  const auto mask = hn::Set(di, shape.side - 1);
  const auto margin = hn::Set(di, WindowTable::margin);
  const auto phases = hn::Set(di, shape.side);
  const auto entries = hn::Set(di, shape.columns * shape.rows * batch_side);
  HWY_ALIGN double x_mm[hn::MaxLanes(d)] = {};
  HWY_ALIGN double y_mm[hn::MaxLanes(d)] = {};
  const std::size_t step = hn::Lanes(d);
  for (std::size_t i = 0; i < from_pivot_mm.size(); i += step) {
    for (std::size_t lane = 0; lane < std::min(step, from_pivot_mm.size() - i); ++lane) {
      x_mm[lane] = from_pivot_mm[i + lane].x;
      y_mm[lane] = from_pivot_mm[i + lane].y;
    }
    const auto px = hn::Load(d, x_mm);
    const auto py = hn::Load(d, y_mm);
    const auto at = [&](auto coordinate) {
      return hn::DemoteTo(di, hn::Min(hn::Max(hn::Floor(coordinate), nearest), farthest));
    };
    const auto kx = at(hn::Add(hn::Sub(hn::Mul(cx, px), hn::Mul(sx, py)), x0));
    const auto ky = at(hn::Add(hn::Add(hn::Mul(sy, px), hn::Mul(cy, py)), y0));
    const auto phase = hn::Add(hn::Mul(hn::And(ky, mask), phases), hn::And(kx, mask));
    hn::StoreU(hn::Mul(phase, entries), di, placed.plane.data() + i);
    hn::StoreU(hn::Add(hn::ShiftRightSame(kx, shape.side_log2), margin), di,
               placed.column.data() + i);
    hn::StoreU(hn::Add(hn::ShiftRightSame(ky, shape.side_log2), margin), di, placed.row.data() + i);
  }
}

/// What 16 bits hold of a sum.
constexpr std::size_t largest_part = 65535;

/// Adds penalties of 16 bits to sums.
HWY_INLINE void add_part(const std::uint16_t* part, std::size_t count, std::uint32_t* sums) {
  const hn::CappedTag<std::uint32_t, batch_tiles> d32;
  const hn::Rebind<std::uint16_t, decltype(d32)> narrow;
  const auto most_sum = hn::Set(d32, largest_sum);
  for (std::size_t i = 0; i < count; i += hn::MaxLanes(d32)) {
    const auto wide = hn::PromoteTo(d32, hn::LoadU(narrow, part + i));
    hn::StoreU(hn::Min(hn::Add(wide, hn::LoadU(d32, sums + i)), most_sum), d32, sums + i);
  }
}

/// Sums the penalties of runs over one batch.
/// @param entry scratch of at least as many elements, rounded up to whole vectors
void AddRuns(std::span<const TableRun> runs, const WindowPlaces& placed, int first_x, int first_y,
             std::int32_t* entry, std::uint32_t* sums) {
  const WindowTable& table = *runs.front().table;  // as all others in shape
  const std::size_t first = runs.front().begin;
  const std::size_t count = runs.back().end - first;
  const hn::ScalableTag<std::int32_t> di;
  const auto zero = hn::Zero(di);
  const auto x = hn::Set(di, first_x);
  const auto y = hn::Set(di, first_y);
  const auto last_column = hn::Set(di, table.columns - batch_side);
  const auto last_row = hn::Set(di, table.rows - batch_side);
  const auto columns = hn::Set(di, table.columns);
  const std::int32_t* const plane = placed.plane.data() + first;
  const std::int32_t* const column = placed.column.data() + first;
  const std::int32_t* const row = placed.row.data() + first;
  for (std::size_t i = 0; i < count; i += hn::Lanes(di)) {
    const auto at_column =
        hn::Min(hn::Max(hn::Add(hn::LoadU(di, column + i), x), zero), last_column);
    const auto at_row = hn::Min(hn::Max(hn::Add(hn::LoadU(di, row + i), y), zero), last_row);
    const auto of_plane = hn::Add(hn::Mul(at_row, columns), at_column);
    hn::StoreU(hn::Add(hn::ShiftLeft<2>(of_plane), hn::LoadU(di, plane + i)), di, entry + i);
  }
  const hn::CappedTag<std::uint16_t, batch_tiles> d16;
  constexpr std::size_t lanes = hn::MaxLanes(d16);
  constexpr std::size_t vectors = batch_tiles / lanes;
  HWY_ALIGN std::uint16_t part[batch_tiles] = {};
  std::size_t room = largest_part;
  for (const TableRun& run : runs) {
    const std::size_t largest = run.table->largest;
    const std::uint16_t* entries = run.table->entries.data();
    for (std::size_t begin = run.begin - first; begin < run.end - first;) {
      const std::size_t left = run.end - first - begin;
      const std::size_t some = largest == 0 ? left : std::min(left, room / largest);
      if (some == 0) {
        add_part(part, batch_tiles, sums);
        std::fill(part, part + batch_tiles, std::uint16_t{0});
        room = largest_part;
        continue;
      }
      const std::size_t end = begin + some;
      for (std::size_t v = 0; v < vectors; ++v) {
        auto sum = hn::Load(d16, part + v * lanes);
        auto other = hn::Zero(d16);
        std::size_t i = begin;
        for (; i + 2 <= end; i += 2) {
          sum = hn::Add(sum, hn::LoadU(d16, entries + entry[i] + v * lanes));
          other = hn::Add(other, hn::LoadU(d16, entries + entry[i + 1] + v * lanes));
        }
        if (i < end) {
          sum = hn::Add(sum, hn::LoadU(d16, entries + entry[i] + v * lanes));
        }
        hn::Store(hn::Add(sum, other), d16, part + v * lanes);
      }
      room -= some * largest;
      begin = end;
    }
  }
  add_part(part, batch_tiles, sums);
}

}  // namespace palpate::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace palpate {

HWY_EXPORT(PlaceWindows);
HWY_EXPORT(AddRuns);

namespace {

/// Room for the last vector of a list.
constexpr std::size_t slack = 64;

}  // namespace

void place_windows(const KnownElements& elements, const TilePlace& place, const WindowTable& shape,
                   WindowPlaces& placed) {
  for (std::vector<std::int32_t>* list : {&placed.plane, &placed.column, &placed.row}) {
    list->resize(elements.from_pivot_mm.size() + slack);
  }
  HWY_DYNAMIC_DISPATCH(PlaceWindows)(elements.from_pivot_mm, place, shape, placed);
}

void add_penalties(const WindowPlaces& placed, std::span<const TableRun> runs, int first_x,
                   int first_y, std::uint32_t* sums) {
  if (runs.empty()) {
    return;
  }
  thread_local std::vector<std::int32_t> scratch;
  scratch.resize(std::max(scratch.size(), runs.back().end - runs.front().begin + slack));
  HWY_DYNAMIC_DISPATCH(AddRuns)(runs, placed, first_x, first_y, scratch.data(), sums);
}

}  // namespace palpate
#endif  // HWY_ONCE
