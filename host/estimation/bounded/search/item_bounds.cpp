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

}  // namespace palpate
