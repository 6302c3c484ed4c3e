#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "estimation/bounded/displaced/places.hpp"
#include "estimation/displacement_weights.hpp"
#include "estimation/log_sum.hpp"

namespace palpate {

// How likelihoods are kept and added up while they are averaged. Of a plane, they are relative to
// its largest.
//
//   of_logs()   replaces logs by likelihoods, given the largest log; minus infinity, where no bin
//               is, by `nothing`
//   weight(), factor()    a weight, and exp(nats), as add() and scaled() take them
//   log_mean()  log of a sum over the weights of its terms
//   least       a sum that is smaller is too inexact

/// As numbers, whose sums are weighted sums.
template <typename Number>
struct LinearLikelihoods {
  using Value = Number;
  static constexpr Value nothing = 0;

  static Value weight(double weight) { return static_cast<Value>(weight); }
  static Value factor(double nats) { return static_cast<Value>(std::exp(nats)); }
  static void add(Value& sum, Value weight, Value likelihood) { sum += weight * likelihood; }
  static Value scaled(Value likelihood, Value scale) { return likelihood * scale; }
};

/// Bounds of tiles, as float32. None is so small that it could vanish.
struct TileLikelihoods : LinearLikelihoods<float> {
  static constexpr bool bounds = true;
  static constexpr double least = 0.0;
  /// More than all that vanishes in float32 adds to a mean.
  static constexpr Value vanished = 1e-30F;

  /// exp(nats) for nats <= 0, within 1e-6 of itself, at least exp(-80): by powers of two and a
  /// polynomial. Numbers are compared by their bits, which compilers turn into vectors.
  static Value of_log(Value nats) {
    const std::uint32_t bits =
        std::min(std::bit_cast<std::uint32_t>(nats), std::bit_cast<std::uint32_t>(-80.0F));
    const Value exponent = std::bit_cast<Value>(bits) * 1.44269504F;
    const auto whole = static_cast<std::int32_t>(exponent - 0.5F);
    const Value f = exponent - static_cast<Value>(whole);
    Value p = 0.001112550962716341F;
    for (const Value term : {0.009666282683610916F, 0.05557400360703468F, 0.24022351205348969F,
                             0.693142831325531F, 1.0F}) {
      p = p * f + term;
    }
    return std::bit_cast<Value>(std::bit_cast<std::int32_t>(p) + (whole << 23));
  }
  static void of_logs(Value* logs, int count, Value largest) {
    constexpr auto no_bin = std::bit_cast<std::uint32_t>(-std::numeric_limits<Value>::infinity());
    for (int i = 0; i < count; ++i) {
      const std::int32_t any = std::bit_cast<std::uint32_t>(logs[i]) == no_bin ? 0 : -1;
      logs[i] = std::bit_cast<Value>(std::bit_cast<std::int32_t>(of_log(logs[i] - largest)) & any);
    }
  }
  static Value larger(Value a, Value b) {
    return std::bit_cast<Value>(
        std::max(std::bit_cast<std::int32_t>(a), std::bit_cast<std::int32_t>(b)));
  }
  static double log_mean(Value sum, double weights) {
    return std::log(sum / static_cast<Value>(weights) + vanished);
  }
};

/// Likelihoods of bins, as float64.
struct BinLikelihoods : LinearLikelihoods<double> {
  static constexpr bool bounds = false;
  static constexpr double least = 1e-250;

  static void of_logs(Value* logs, int count, Value largest) {
    for (int i = 0; i < count; ++i) {
      logs[i] = std::isinf(logs[i]) ? nothing : std::exp(logs[i] - largest);
    }
  }
  static double log_mean(Value sum, double weights) { return std::log(sum / weights); }
};

/// Likelihoods of bins by their logs, for those that float64 does not hold.
struct BinLogs {
  using Value = double;
  static constexpr Value nothing = -std::numeric_limits<Value>::infinity();
  static constexpr bool bounds = false;
  static constexpr double least = nothing;

  static void of_logs(Value* logs, int count, Value largest) {
    for (int i = 0; i < count; ++i) {
      logs[i] = std::isinf(logs[i]) ? nothing : logs[i] - largest;
    }
  }
  static Value weight(double weight) { return std::log(weight); }
  static Value factor(double nats) { return nats; }
  static void add(Value& sum, Value weight, Value log) { sum = log_add(sum, weight + log); }
  static Value scaled(Value log, Value scale) { return log + scale; }
  static double log_mean(Value sum, double weights) { return sum - std::log(weights); }
};

/// Blocks [first, end) along each axis.
struct BlockRange {
  int x_first = std::numeric_limits<int>::max();
  int x_end = 0;
  int y_first = std::numeric_limits<int>::max();
  int y_end = 0;

  bool empty() const { return x_first >= x_end || y_first >= y_end; }
};

/// Blocks of one theta, within a range.
class BlockSet {
 public:
  explicit BlockSet(const BlockRange& range)
      : range_(range),
        width_(range.x_end - range.x_first),
        in_(static_cast<std::size_t>(width_) * (range.y_end - range.y_first)) {}

  void add(const BlockRange& blocks) {
    for (int y = blocks.y_first; y < blocks.y_end; ++y) {
      std::fill_n(in_.begin() + index(blocks.x_first, y), blocks.x_end - blocks.x_first,
                  std::uint8_t{1});
    }
  }
  /// All blocks within so many of these, as far as the range and the axes' blocks reach.
  BlockSet with_neighbours(int x_blocks, int y_blocks, int x_count, int y_count) const {
    BlockSet all(range_);
    for (const BlockRun& run : runs(0)) {
      all.add({.x_first = std::max({range_.x_first, 0, run.x - x_blocks}),
               .x_end = std::min({range_.x_end, x_count, run.x + run.count + x_blocks}),
               .y_first = std::max({range_.y_first, 0, run.y - y_blocks}),
               .y_end = std::min({range_.y_end, y_count, run.y + 1 + y_blocks})});
    }
    return all;
  }
  std::vector<BlockRun> runs(int theta) const {
    std::vector<BlockRun> runs;
    for (int y = range_.y_first; y < range_.y_end; ++y) {
      for (int x = range_.x_first; x < range_.x_end; ++x) {
        if (in_[index(x, y)] != 0) {
          append_block(theta, y, x, runs);
        }
      }
    }
    return runs;
  }

 private:
  std::ptrdiff_t index(int x, int y) const {
    return std::ptrdiff_t{y - range_.y_first} * width_ + (x - range_.x_first);
  }

  BlockRange range_;
  int width_;
  std::vector<std::uint8_t> in_;  ///< [y, x]
};

inline int blocks_of(const AxisBlur& axis) {
  return (static_cast<int>(axis.scale.size()) + BlockRun::side - 1) / BlockRun::side;
}

/// An AxisBlur in a domain's numbers.
template <typename Domain>
struct BlurIn {
  using Value = typename Domain::Value;

  explicit BlurIn(const AxisBlur& axis)
      : places(static_cast<int>(axis.scale.size())),
        blocks(blocks_of(axis)),
        reach((axis.reach() + BlockRun::side - 1) / BlockRun::side) {
    std::ranges::transform(axis.weight, std::back_inserter(weight), Domain::weight);
    std::ranges::transform(axis.scale, std::back_inserter(scale), Domain::weight);
  }

  /// Adds up neighbours by their distance's weight.
  /// @param stride between neighbours
  void blur(const Value* from, Value* __restrict to, int count, std::ptrdiff_t stride) const {
    for (int i = 0; i < count; ++i) {
      to[i] = Domain::scaled(from[i], weight[0]);
    }
    for (std::size_t k = 1; k < weight.size(); ++k) {
      const Value of_step = weight[k];
      const Value* const below = from - static_cast<std::ptrdiff_t>(k) * stride;
      const Value* const above = from + static_cast<std::ptrdiff_t>(k) * stride;
      for (int i = 0; i < count; ++i) {
        Domain::add(to[i], of_step, below[i]);
        Domain::add(to[i], of_step, above[i]);
      }
    }
  }

  int places;
  int blocks;
  int reach;  ///< in blocks
  std::vector<Value> weight;
  std::vector<Value> scale;
};

/// One theta's likelihoods, blurred along y and x at the blocks that were asked for.
template <typename Domain>
struct BlurredPlane {
  using Value = typename Domain::Value;

  /// Log of the largest before the blur, in nats.
  double reference = -std::numeric_limits<double>::infinity();
  std::ptrdiff_t pitch = 0;
  int x = 0;  ///< of the first place
  int y = 0;
  int height = 0;
  /// [y, x] relative to the reference; nothing outside the region. Of tiles of several bins, see
  /// max_with_next().
  std::vector<Value> blurred;

  PlaceRows<Value> rows(std::vector<Value>& values) const { return {values.data(), pitch, x, y}; }
};

/// Replaces each place by the largest of itself, the next one along x, and those above both; also
/// the places before the first ones of the region.
/// @param runs the places that hold something
template <typename Domain>
void max_with_next(std::span<const BlockRun> runs, const PlaceRows<typename Domain::Value>& rows) {
  using Value = typename Domain::Value;
  const auto first = [](int block) { return block == 0 ? -1 : BlockRun::side * block; };
  const auto take = [&](const BlockRun& run, int y, const Value* next) {
    Value* const row = rows.at(first(run.x), y);
    const int count = BlockRun::side * (run.x + run.count) - first(run.x);
    for (int i = 0; i < count; ++i) {
      row[i] = Domain::larger(row[i], next[i]);
    }
  };
  for (const BlockRun& run : runs) {
    for (int y = BlockRun::side * run.y; y < BlockRun::side * (run.y + 1); ++y) {
      take(run, y, rows.at(first(run.x) + 1, y));
    }
  }
  for (const BlockRun& run : runs) {
    for (int y = first(run.y); y < BlockRun::side * (run.y + 1); ++y) {
      take(run, y, rows.at(first(run.x), y + 1));
    }
  }
}

/// Calls visit(x, y, count) for every row of the runs' places.
template <typename Visit>
void for_rows(std::span<const BlockRun> runs, const Visit& visit) {
  for (const BlockRun& run : runs) {
    for (int y = BlockRun::side * run.y; y < BlockRun::side * (run.y + 1); ++y) {
      visit(BlockRun::side * run.x, y, BlockRun::side * run.count);
    }
  }
}

/// @param several_bins places are tiles of more than one bin: a turn moves one to between four
template <typename Domain>
BlurredPlane<Domain> blurred_plane(int theta, std::span<const BlockRange> asked,
                                   const BlurIn<Domain>& blur_x, const BlurIn<Domain>& blur_y,
                                   bool several_bins,
                                   const PlaceSource<typename Domain::Value>& source) {
  using Value = typename Domain::Value;
  BlockRange window;
  for (const BlockRange& blocks : asked) {
    window = {std::min(window.x_first, blocks.x_first), std::max(window.x_end, blocks.x_end),
              std::min(window.y_first, blocks.y_first), std::max(window.y_end, blocks.y_end)};
  }
  // A block more on every side, since taps lie between places.
  const int x_margin = std::max(1, blur_x.reach);
  const int y_margin = std::max(1, blur_y.reach);
  window = {window.x_first - x_margin, window.x_end + x_margin, window.y_first - y_margin,
            window.y_end + y_margin};
  BlockSet wanted(window);
  for (const BlockRange& blocks : asked) {
    wanted.add(blocks);
  }
  const BlockSet along_x = wanted.with_neighbours(blur_x.reach, 0, blur_x.blocks, blur_y.blocks);
  const std::vector<BlockRun> sources =
      along_x.with_neighbours(0, blur_y.reach, blur_x.blocks, blur_y.blocks).runs(theta);

  BlurredPlane<Domain> plane{.pitch = BlockRun::side * (window.x_end - window.x_first),
                             .x = BlockRun::side * window.x_first,
                             .y = BlockRun::side * window.y_first,
                             .height = BlockRun::side * (window.y_end - window.y_first)};
  std::vector<Value> likelihood(static_cast<std::size_t>(plane.pitch * plane.height),
                                Domain::nothing);
  const PlaceRows<Value> rows = plane.rows(likelihood);
  constexpr auto no_bin = -std::numeric_limits<Value>::infinity();
  for_rows(sources, [&](int x, int y, int count) { std::fill_n(rows.at(x, y), count, no_bin); });
  source(sources, rows);
  Value largest = no_bin;
  for_rows(sources, [&](int x, int y, int count) {
    largest = std::max(largest, *std::max_element(rows.at(x, y), rows.at(x, y) + count));
  });
  plane.reference = largest;
  for_rows(sources,
           [&](int x, int y, int count) { Domain::of_logs(rows.at(x, y), count, largest); });

  std::vector<Value> along_y(likelihood.size(), Domain::nothing);
  const PlaceRows<Value> middle = plane.rows(along_y);
  for_rows(along_x.runs(theta), [&](int x, int y, int count) {
    if (y < blur_y.places) {
      Value* const row = middle.at(x, y);
      blur_y.blur(rows.at(x, y), row, count, plane.pitch);
      for (int i = 0; i < count; ++i) {
        row[i] = Domain::scaled(row[i], blur_y.scale[y]);
      }
    }
  });
  plane.blurred.assign(likelihood.size(), Domain::nothing);
  const PlaceRows<Value> result = plane.rows(plane.blurred);
  const std::vector<BlockRun> results = wanted.runs(theta);
  for_rows(results, [&](int x, int y, int count) {
    Value* const row = result.at(x, y);
    const int inside = std::min(count, blur_x.places - x);
    blur_x.blur(middle.at(x, y), row, inside, 1);
    for (int i = 0; i < inside; ++i) {
      row[i] = Domain::scaled(row[i], blur_x.scale[x + i]);
    }
  });
  if constexpr (Domain::bounds) {
    if (several_bins) {
      max_with_next<Domain>(results, result);
    }
  }
  return plane;
}

}  // namespace palpate
