#include "estimation/bounded/search/largest_tiles.hpp"

#include <algorithm>

#include "estimation/bounded/search/item_bounds.hpp"

namespace palpate {

namespace {

/// Batches of the largest tiles at one theta that make a region small.
constexpr int few_batches = 16;

/// The batches of the tiles in which an element may see the map.
/// @param reaches [theta] of the elements
std::vector<BlockRun> seen_batches(std::span<const BoundingBox> reaches, const OccupancyGrid& map,
                                   const TileLevel& level) {
  const auto end = [](int tile) { return (tile + batch_side - 1) / batch_side; };
  std::vector<BlockRun> runs;
  for (std::size_t theta = 0; theta < reaches.size(); ++theta) {
    const TileRange tiles = seen_tiles(reaches[theta], map, level);
    const int x = tiles.x_first / batch_side;
    const int count = end(tiles.x_end) - x;
    for (int y = tiles.y_first / batch_side; count > 0 && y < end(tiles.y_end); ++y) {
      runs.push_back({static_cast<int>(theta), y, x, count});
    }
  }
  return runs;
}

}  // namespace

LargestTiles::LargestTiles(const SearchSpace& space)
    : space_(space), off_map_(space.bounds.size()) {
  for (const TileBounds& bounds : space.bounds) {
    const TileLevel& level = bounds.levels().front();
    sums_.emplace_back(space.turns.size() * level.batches_x() * level.batches_y() * batch_tiles);
  }
}

void LargestTiles::reset() {
  for (std::vector<std::int32_t>& sums : sums_) {
    std::fill(sums.begin(), sums.end(), 0);
  }
  std::fill(off_map_.begin(), off_map_.end(), 0);
  upper_bounds_.clear();
}

void LargestTiles::add(std::span<const KnownElements> touches) {
  // A single touch sees little of a large region; in a small one, fewer rounds are faster.
  const TileLevel& level = space_.bounds.front().levels().front();
  if (level.batches_x() * level.batches_y() <= few_batches) {
    add(merged(touches));
    return;
  }
  for (const KnownElements& touch : touches) {
    add(touch);
  }
}

void LargestTiles::add(const KnownElements& elements) {
  for (const KnownElements& item : elements.items()) {
    if (item.runs.empty()) {
      continue;
    }
    const std::vector<BoundingBox> reaches = reaches_of(item, space_);
    std::vector<double>& upper_bounds = upper_bounds_.emplace_back();
    for (std::size_t object = 0; object < space_.bounds.size(); ++object) {
      const TileBounds& bounds = space_.bounds[object];
      const TileLevel& level = bounds.levels().front();
      const std::vector<BlockRun> seen = seen_batches(reaches, space_.maps[object], level);
      const std::vector<std::int32_t> added = penalties_of(item, space_, object, 0, seen);
      const auto off_map = static_cast<std::int32_t>(bounds.penalty_beyond(0, item));
      const std::int64_t offset = std::min<std::int64_t>(off_map, largest_sum - off_map_[object]);
      auto from = added.begin();
      for (const BlockRun& run : seen) {
        const std::ptrdiff_t row =
            (std::ptrdiff_t{run.theta} * level.batches_y() + run.y) * level.batches_x() + run.x;
        const auto sums = std::span(sums_[object])
                              .subspan(static_cast<std::size_t>(row) * batch_tiles,
                                       static_cast<std::size_t>(run.count) * batch_tiles);
        for (std::int32_t& sum : sums) {
          sum = static_cast<std::int32_t>(
              std::min<std::int64_t>(std::int64_t{sum} + *from++ - offset, largest_sum));
        }
      }
      off_map_[object] += offset;
      const std::int32_t least =
          added.empty() ? off_map : std::min(off_map, std::ranges::min(added));
      upper_bounds.push_back(bounds.best(0, item) - least / penalties_per_nat);
    }
  }
}

std::uint64_t LargestTiles::bytes() const {
  std::uint64_t bytes = 0;
  for (const std::vector<std::int32_t>& sums : sums_) {
    bytes += sums.capacity() * sizeof(std::int32_t);
  }
  return bytes;
}

}  // namespace palpate
