#include "estimation/bounded/search/largest_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "estimation/bounded/search/displaced_tiles.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

/// Batches of the largest tiles at one theta that make a region small.
constexpr int few_batches = 16;

/// The tiles of an axis that overlap [lower, upper] in mm.
std::pair<int, int> overlapping(const TileAxis& axis, double lower_mm, double upper_mm) {
  // Rounding must not leave a tile out.
  const auto tiles = static_cast<double>(axis.tiles());
  const double first = std::floor((lower_mm - axis.first_mm) / axis.side_mm - 1e-6);
  const double last = std::floor((upper_mm - axis.first_mm) / axis.side_mm + 1e-6);
  return {static_cast<int>(std::clamp(first, 0.0, tiles)),
          static_cast<int>(std::clamp(last + 1.0, 0.0, tiles))};
}

/// The batches of the tiles in which an element may see the map.
BlockRange seen_batches(const BoundingBox& reach, const OccupancyGrid& map,
                        const TileLevel& level) {
  const TileRange tiles = seen_tiles(reach, map, level);
  const auto end = [](int tile) { return (tile + batch_side - 1) / batch_side; };
  return {.x_first = tiles.x_first / batch_side,
          .x_end = end(tiles.x_end),
          .y_first = tiles.y_first / batch_side,
          .y_end = end(tiles.y_end)};
}

/// Index of the first sum of a batch.
std::size_t first_tile(const TileLevel& level, std::size_t theta, int y, int x) {
  const std::size_t row = theta * static_cast<std::size_t>(level.batches_y()) + y;
  return (row * static_cast<std::size_t>(level.batches_x()) + x) * batch_tiles;
}

}  // namespace

LargestTiles::LargestTiles(const SearchSpace& space) : space_(space), unseen_(space.bounds.size()) {
  for (const TileBounds& bounds : space.bounds) {
    const TileLevel& level = bounds.levels().front();
    sums_.emplace_back(space.turns.size() * level.batches_x() * level.batches_y() * batch_tiles);
  }
}

void LargestTiles::reset() {
  for (std::vector<std::int32_t>& sums : sums_) {
    std::fill(sums.begin(), sums.end(), 0);
  }
  std::fill(unseen_.begin(), unseen_.end(), 0);
  most_.clear();
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
  if (!space_.displacement) {
    with_offsets(elements, [&](const auto& offsets) { add_exact(elements, offsets); });
    return;
  }
  for (const KnownElements& touch : elements.touches) {
    with_offsets(touch, [&](const auto& offsets) { add_displaced(touch, offsets); });
  }
}

template <typename Add>
void LargestTiles::with_offsets(const KnownElements& known, const Add& add) {
  std::vector<std::int64_t> offsets;
  for (std::size_t i = 0; i < unseen_.size(); ++i) {
    offsets.push_back(std::min<std::int64_t>(space_.bounds[i].penalty_beyond(0, known),
                                             largest_sum - unseen_[i]));
  }
  add(offsets);
  std::ranges::transform(unseen_, offsets, unseen_.begin(), std::plus());
}

template <typename Penalty>
void LargestTiles::raise(std::int32_t* sums, std::span<const Penalty> added,
                         std::int64_t offset) const {
  for (std::size_t i = 0; i < added.size(); ++i) {
    const std::int64_t sum = std::int64_t{sums[i]} + added[i] - offset;
    sums[i] = static_cast<std::int32_t>(std::min<std::int64_t>(sum, largest_sum));
  }
}

void LargestTiles::add_exact(const KnownElements& known, const std::vector<std::int64_t>& offsets) {
  const std::vector<BoundingBox> reaches = reaches_of(known, space_.turns);
  const std::size_t thetas = space_.turns.size();
  parallel_for(space_.bounds.size() * thetas, [&](std::size_t row) {
    thread_local WindowPlaces placed;
    const std::size_t object = row / thetas;
    const std::size_t theta = row % thetas;
    const TileBounds& bounds = space_.bounds[object];
    const TileLevel& level = bounds.levels().front();
    const BlockRange seen = seen_batches(reaches[theta], space_.maps[object], level);
    bounds.place(0, space_.turns[theta], known, placed);
    for (int y = seen.y_first; y < seen.y_end; ++y) {
      for (int x = seen.x_first; x < seen.x_end; ++x) {
        std::uint32_t added[batch_tiles] = {};
        bounds.add(0, known, placed, x * batch_side, y * batch_side, added);
        raise(sums_[object].data() + first_tile(level, theta, y, x),
              std::span<const std::uint32_t>(added), offsets[object]);
      }
    }
  });
}

void LargestTiles::add_displaced(const KnownElements& touch,
                                 const std::vector<std::int64_t>& offsets) {
  const std::vector<BoundingBox> reaches = displaced_reaches(space_, std::span(&touch, 1));
  std::vector<double>& most = most_.emplace_back();
  for (std::size_t object = 0; object < space_.bounds.size(); ++object) {
    const TileLevel& level = space_.bounds[object].levels().front();
    std::vector<BlockRun> runs;
    for (std::size_t theta = 0; theta < space_.turns.size(); ++theta) {
      const BlockRange seen = seen_batches(reaches[theta], space_.maps[object], level);
      for (int y = seen.y_first; !seen.empty() && y < seen.y_end; ++y) {
        runs.push_back({static_cast<int>(theta), y, seen.x_first, seen.x_end - seen.x_first});
      }
    }
    const std::vector<std::int32_t> added = displaced_penalties(space_, object, 0, touch, runs);
    const auto beyond = static_cast<std::int32_t>(space_.bounds[object].penalty_beyond(0, touch));
    const std::int32_t least = added.empty() ? beyond : std::min(beyond, std::ranges::min(added));
    std::span<const std::int32_t> rest = added;
    for (const BlockRun& run : runs) {
      const std::size_t tiles = static_cast<std::size_t>(run.count) * batch_tiles;
      raise(sums_[object].data() +
                first_tile(level, static_cast<std::size_t>(run.theta), run.y, run.x),
            rest.first(tiles), offsets[object]);
      rest = rest.subspan(tiles);
    }
    most.push_back(space_.bounds[object].best(0, touch) - least / penalties_per_nat);
  }
}

std::uint64_t LargestTiles::bytes() const {
  std::uint64_t bytes = 0;
  for (const std::vector<std::int32_t>& sums : sums_) {
    bytes += sums.capacity() * sizeof(std::int32_t);
  }
  return bytes;
}

std::vector<BoundingBox> reaches_of(const KnownElements& elements,
                                    std::span<const glm::dvec2> turns) {
  std::vector<BoundingBox> reaches(turns.size());
  for (std::size_t theta = 0; theta < turns.size(); ++theta) {
    const glm::dvec2& turn = turns[theta];
    for (const glm::dvec2& p : elements.from_pivot_mm) {
      reaches[theta].take_in({turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y});
    }
  }
  return reaches;
}

TileRange seen_tiles(const BoundingBox& reach, const OccupancyGrid& map, const TileLevel& level) {
  if (reach.empty()) {
    return {};
  }
  // The map fades to the prior within a cell.
  const glm::dvec2 lower_mm = map.origin_mm - map.cell_mm - reach.upper;
  const glm::dvec2 upper_mm =
      map.origin_mm + map.cell_mm * glm::dvec2(map.nx, map.ny) - reach.lower;
  const auto [x_first, x_end] = overlapping(level.x, lower_mm.x, upper_mm.x);
  const auto [y_first, y_end] = overlapping(level.y, lower_mm.y, upper_mm.y);
  return {x_first, std::max(x_first, x_end), y_first, std::max(y_first, y_end)};
}

}  // namespace palpate
