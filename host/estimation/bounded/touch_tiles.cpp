#include "touch_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "parallel_for.hpp"
#include "reading_penalties.hpp"
#include "window_table.hpp"

namespace palpate {

namespace {

/// Tiles of a level that are divided at most: bounds time and memory.
constexpr std::size_t most_divided = std::size_t{1} << 12;
/// Part of the weight whose tiles stay as they are.
constexpr double undivided_share = 1e-3;
/// Tiles of one object and theta that a task divides.
constexpr std::size_t tiles_per_task = 64;

/// Tiles [first, end) of an axis that may hold bins [begin, begin + count).
struct TileRange {
  int first = 0;
  int end = 0;

  TileRange(const TileAxis& axis, int begin, int count) {
    const auto starts = axis.first_bin.begin();
    const auto tiles = starts + axis.tiles();
    first = std::max(0, static_cast<int>(std::upper_bound(starts, tiles, begin) - starts) - 1);
    end = static_cast<int>(std::lower_bound(starts, tiles, begin + count) - starts);
  }
};

/// Bins [first, first + count) that are in a tile and among `of`.
std::pair<std::int32_t, std::int32_t> common(const TileAxis& axis, int tile, std::int32_t of_first,
                                             std::int32_t of_count) {
  const std::int32_t first = std::max(axis.first_bin[tile], of_first);
  const std::int32_t end = std::min(axis.first_bin[tile + 1], of_first + of_count);
  return {first, std::max(0, end - first)};
}

/// Appends those of the 4 x 4 tiles of a batch that hold bins of a box.
class Batch {
 public:
  Batch(const TileBounds& bounds, std::size_t level, double log_weight,
        const KnownElements& elements, const std::function<bool(const BinBox&)>& counts)
      : bounds_(bounds),
        level_(level),
        log_weight_(log_weight),
        elements_(elements),
        counts_(counts),
        best_(bounds.best(level, elements)) {}

  void append(const WindowPlaces& placed, int first_x, int first_y, const BinBox& box,
              std::vector<TouchTile>& tiles) const {
    std::uint32_t sums[batch_tiles] = {};
    bounds_.add(level_, elements_, placed, first_x, first_y, sums);
    const TileLevel& level = bounds_.levels()[level_];
    for (int j = 0; j < batch_side; ++j) {
      const auto [y_first, y_count] = common(level.y, first_y + j, box.y_first, box.y_count);
      for (int i = 0; y_count > 0 && i < batch_side; ++i) {
        const auto [x_first, x_count] = common(level.x, first_x + i, box.x_first, box.x_count);
        const BinBox part{box.object, box.theta, y_first, y_count, x_first, x_count};
        if (x_count > 0 && counts_(part)) {
          TouchTile tile{.bound = best_ - sums[batch_side * i + j] / penalties_per_nat,
                         .box = part,
                         .x = first_x + i,
                         .y = first_y + j};
          tile.log_weight =
              log_weight_ + tile.bound + std::log(static_cast<double>(tile.box.bins()));
          tiles.push_back(tile);
        }
      }
    }
  }

 private:
  const TileBounds& bounds_;
  std::size_t level_;
  double log_weight_;
  const KnownElements& elements_;
  const std::function<bool(const BinBox&)>& counts_;
  double best_;
};

std::vector<TouchTile> joined(const std::vector<std::vector<TouchTile>>& parts) {
  std::size_t count = 0;
  for (const std::vector<TouchTile>& part : parts) {
    count += part.size();
  }
  std::vector<TouchTile> all;
  all.reserve(count);
  for (const std::vector<TouchTile>& part : parts) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

/// The least weight of a tile that is worth dividing.
double least_divided(std::span<const TouchTile> tiles) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const TouchTile& tile : tiles) {
    largest = std::max(largest, tile.log_weight);
  }
  std::vector<double> weights;  // relative to the largest
  weights.reserve(tiles.size());
  double left = 0.0;
  for (const TouchTile& tile : tiles) {
    weights.push_back(std::exp(tile.log_weight - largest));
    left += weights.back();
  }
  const double rest = undivided_share * left;
  const auto end =
      weights.begin() + static_cast<std::ptrdiff_t>(std::min(most_divided, weights.size()));
  std::nth_element(weights.begin(), end - 1, weights.end(), std::greater<>());
  std::sort(weights.begin(), end, std::greater<>());
  auto least = weights.begin();
  for (left -= *least; least + 1 != end && left > rest; left -= *least) {
    ++least;
  }
  // Rounding may leave a tile out or take one more in.
  return largest + std::log(*least);
}

}  // namespace

std::vector<TouchTile> touch_tiles(std::span<const BinBox> boxes,
                                   std::span<const TileBounds> bounds,
                                   std::span<const double> log_weight,
                                   std::span<const glm::dvec2> turns, const KnownElements& elements,
                                   const std::function<bool(const BinBox&)>& counts) {
  std::vector<std::vector<TouchTile>> of_box(boxes.size());
  parallel_for(boxes.size(), [&](std::size_t i) {
    thread_local WindowPlaces placed;
    const BinBox& box = boxes[i];
    const TileBounds& of = bounds[box.object];
    const TileLevel& level = of.levels().front();
    of.place(0, turns[box.theta], elements, placed);
    const Batch batch(of, 0, log_weight[box.object], elements, counts);
    const TileRange x(level.x, box.x_first, box.x_count);
    const TileRange y(level.y, box.y_first, box.y_count);
    for (int ty = y.first / batch_side * batch_side; ty < y.end; ty += batch_side) {
      for (int tx = x.first / batch_side * batch_side; tx < x.end; tx += batch_side) {
        batch.append(placed, tx, ty, box, of_box[i]);
      }
    }
  });
  std::vector<TouchTile> tiles = joined(of_box);
  std::vector<TouchTile> settled;
  for (std::size_t level = 1; !tiles.empty() && level < bounds.front().levels().size(); ++level) {
    const double least = least_divided(tiles);
    const auto rest = std::stable_partition(tiles.begin(), tiles.end(), [&](const TouchTile& tile) {
      return tile.log_weight >= least;
    });
    settled.insert(settled.end(), rest, tiles.end());
    tiles.erase(rest, tiles.end());
    std::vector<std::size_t> begins;  // of tasks: tiles of one object and theta
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (i == 0 || tiles[i].box.object != tiles[i - 1].box.object ||
          tiles[i].box.theta != tiles[i - 1].box.theta || i - begins.back() == tiles_per_task) {
        begins.push_back(i);
      }
    }
    std::vector<std::vector<TouchTile>> parts(begins.size());
    parallel_for(begins.size(), [&](std::size_t task) {
      thread_local WindowPlaces placed;
      const BinBox& first = tiles[begins[task]].box;
      const std::size_t end = task + 1 < begins.size() ? begins[task + 1] : tiles.size();
      bounds[first.object].place(level, turns[first.theta], elements, placed);
      const Batch batch(bounds[first.object], level, log_weight[first.object], elements, counts);
      for (std::size_t i = begins[task]; i < end; ++i) {
        batch.append(placed, batch_side * tiles[i].x, batch_side * tiles[i].y, tiles[i].box,
                     parts[task]);
      }
    });
    tiles = joined(parts);
  }
  tiles.insert(tiles.end(), settled.begin(), settled.end());
  return tiles;
}

}  // namespace palpate
