#include "estimation/bounded/search/item_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

/// Batches of one theta that a task bounds.
constexpr std::size_t batches_per_task = 64;
/// Penalties that float32 holds exactly; larger ones count as much, which leaves bounds true.
constexpr std::uint32_t largest_exact = std::uint32_t{1} << 24;

/// Calls visit(x, y, sums) for batches of one theta: the first tile of each, and the sums of its
/// tiles' penalties where the sensor stood as the robot says.
template <typename Visit>
void for_batches(const KnownElements& item, const SearchSpace& space, std::size_t object,
                 std::size_t level, std::span<const BlockRun> batches, const Visit& visit) {
  const TileBounds& bounds = space.bounds[object];
  thread_local WindowPlaces placed;
  bounds.place(level, space.turns[static_cast<std::size_t>(batches.front().theta)], item, placed);
  for (const BlockRun& run : batches) {
    const int y = batch_side * run.y;
    for (int x = batch_side * run.x; x < batch_side * (run.x + run.count); x += batch_side) {
      std::uint32_t sums[batch_tiles] = {};
      bounds.add(level, item, placed, x, y, sums);
      visit(x, y, sums);
    }
  }
}

std::vector<std::int32_t> undisplaced_penalties(const KnownElements& item, const SearchSpace& space,
                                                std::size_t object, std::size_t level,
                                                std::span<const BlockRun> batches) {
  struct Task {
    std::size_t first_run;
    std::size_t first_batch;
  };
  std::vector<Task> tasks;
  std::size_t count = 0;
  for (std::size_t i = 0; i < batches.size(); ++i) {
    if (i == 0 || batches[i].theta != batches[i - 1].theta ||
        count - tasks.back().first_batch >= batches_per_task) {
      tasks.push_back({i, count});
    }
    count += static_cast<std::size_t>(batches[i].count);
  }
  std::vector<std::int32_t> penalties(count * batch_tiles);
  parallel_for(tasks.size(), [&](std::size_t i) {
    const auto [first, batch] = tasks[i];
    const std::size_t end = i + 1 < tasks.size() ? tasks[i + 1].first_run : batches.size();
    std::int32_t* to = penalties.data() + batch * batch_tiles;
    for_batches(item, space, object, level, batches.subspan(first, end - first),
                [&](int /*x*/, int /*y*/, const std::uint32_t* sums) {
                  to = std::copy_n(sums, batch_tiles, to);
                });
  });
  return penalties;
}

std::vector<std::int32_t> displaced_penalties(const KnownElements& touch, const SearchSpace& space,
                                              std::size_t object, std::size_t level,
                                              std::span<const BlockRun> batches) {
  const TileLevel& tiling = space.bounds[object].levels()[level];
  const auto source = [&](std::span<const BlockRun> runs, const PlaceRows<float>& rows) {
    for_batches(touch, space, object, level, runs, [&](int x, int y, const std::uint32_t* sums) {
      for (int j = 0; j < batch_side && tiling.y.bins(y + j) > 0; ++j) {
        float* const row = rows.at(x, y + j);
        for (int i = 0; i < batch_side && tiling.x.bins(x + i) > 0; ++i) {
          row[i] = static_cast<float>(std::min(sums[batch_side * i + j], largest_exact)) *
                   static_cast<float>(-1.0 / penalties_per_nat);
        }
      }
    });
  };
  const std::vector<double> logs =
      space.displaced[level].bounds(touch.sensor_from_pivot_mm, batches, source);
  std::vector<std::int32_t> penalties(logs.size());
  for (std::size_t batch = 0; batch < logs.size(); batch += batch_tiles) {
    for (std::size_t i = 0; i < batch_side; ++i) {
      for (std::size_t j = 0; j < batch_side; ++j) {
        const double penalty = std::floor(-penalties_per_nat * logs[batch + batch_side * j + i]);
        penalties[batch + batch_side * i + j] =
            static_cast<std::int32_t>(std::min(penalty, static_cast<double>(largest_sum)));
      }
    }
  }
  return penalties;
}

/// The tiles of an axis that overlap [lower, upper] in mm.
std::pair<int, int> overlapping(const TileAxis& axis, double lower_mm, double upper_mm) {
  // Rounding must not leave a tile out.
  const auto tiles = static_cast<double>(axis.tiles());
  const double first = std::floor((lower_mm - axis.first_mm) / axis.side_mm - 1e-6);
  const double last = std::floor((upper_mm - axis.first_mm) / axis.side_mm + 1e-6);
  return {static_cast<int>(std::clamp(first, 0.0, tiles)),
          static_cast<int>(std::clamp(last + 1.0, 0.0, tiles))};
}

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

std::vector<std::int32_t> penalties_of(const KnownElements& item, const SearchSpace& space,
                                       std::size_t object, std::size_t level,
                                       std::span<const BlockRun> batches) {
  return space.displacement ? displaced_penalties(item, space, object, level, batches)
                            : undisplaced_penalties(item, space, object, level, batches);
}

std::vector<BoundingBox> reaches_of(const KnownElements& elements, const SearchSpace& space) {
  if (!space.displacement) {
    return undisplaced_reaches(elements, space.turns);
  }
  std::vector<BoundingBox> reaches(space.turns.size());
  const DisplacementWeights& weights = *space.displacement;
  const PoseLattice& lattice = weights.lattice();
  const glm::dvec2 step_mm(lattice.x_mm.count > 1 ? lattice.x_mm.step() : 0.0,
                           lattice.y_mm.count > 1 ? lattice.y_mm.step() : 0.0);
  for (const KnownElements& touch : elements.items()) {
    const std::vector<BoundingBox> turned = undisplaced_reaches(touch, space.turns);
    for (std::size_t theta = 0; theta < reaches.size() && !touch.runs.empty(); ++theta) {
      for (const Tap& tap : weights.taps(static_cast<int>(theta), touch.sensor_from_pivot_mm)) {
        const glm::dvec2 moved = glm::dvec2(tap.bins) * step_mm;
        reaches[theta].take_in(turned[tap.theta].lower + moved - weights.reach_mm());
        reaches[theta].take_in(turned[tap.theta].upper + moved + weights.reach_mm());
      }
    }
  }
  return reaches;
}

std::vector<BoundingBox> undisplaced_reaches(const KnownElements& elements,
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
