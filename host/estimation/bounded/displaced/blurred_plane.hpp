#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "estimation/bounded/displaced/places.hpp"
#include "estimation/displacement_weights.hpp"
#include "estimation/log_sum.hpp"

namespace palpate {

// How likelihoods are kept and added up. Of a plane, they are relative to its largest.

/// Bounds of tiles, as float32. None is so small that it could vanish.
struct TileLikelihoods {
  using Value = float;
  static constexpr Value nothing = 0.0F;
  static constexpr bool bounds = true;
  static constexpr double least = 0.0;  // a sum that is smaller is too inexact
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
  /// Replaces logs, less the largest, by likelihoods; minus infinity, where no bin is, by nothing.
  static void of_logs(Value* logs, int count, Value largest) {
    constexpr auto no_bin = std::bit_cast<std::uint32_t>(-std::numeric_limits<Value>::infinity());
    for (int i = 0; i < count; ++i) {
      const std::int32_t any = std::bit_cast<std::uint32_t>(logs[i]) == no_bin ? 0 : -1;
      logs[i] = std::bit_cast<Value>(std::bit_cast<std::int32_t>(of_log(logs[i] - largest)) & any);
    }
  }
  static Value weight(double weight) { return static_cast<Value>(weight); }
  static Value factor(double nats) { return static_cast<Value>(std::exp(nats)); }
  static void add(Value& sum, Value weight, Value likelihood) { sum += weight * likelihood; }
  static Value larger(Value a, Value b) {
    return std::bit_cast<Value>(
        std::max(std::bit_cast<std::int32_t>(a), std::bit_cast<std::int32_t>(b)));
  }
  static Value scaled(Value likelihood, Value scale) { return likelihood * scale; }
  /// Log of the sum over the weights of its terms.
  static double log_mean(Value sum, double weights) {
    return std::log(sum / static_cast<Value>(weights) + vanished);
  }
};

/// Likelihoods of bins, as float64.
struct BinLikelihoods {
  using Value = double;
  static constexpr Value nothing = 0.0;
  static constexpr bool bounds = false;
  static constexpr double least = 1e-250;

  static Value of_log(Value nats) { return std::exp(nats); }
  static Value weight(double weight) { return weight; }
  static Value factor(double nats) { return std::exp(nats); }
  static void add(Value& sum, Value weight, Value likelihood) { sum += weight * likelihood; }
  static Value scaled(Value likelihood, Value scale) { return likelihood * scale; }
  static double log_mean(Value sum, double weights) { return std::log(sum / weights); }
};

/// Likelihoods of bins by their logs, for those that float64 does not hold.
struct BinLogs {
  using Value = double;
  static constexpr Value nothing = -std::numeric_limits<Value>::infinity();
  static constexpr bool bounds = false;
  static constexpr double least = -std::numeric_limits<double>::infinity();

  static Value of_log(Value nats) { return nats; }
  static Value weight(double weight) { return std::log(weight); }
  static Value factor(double nats) { return nats; }
  static void add(Value& sum, Value weight, Value log) { sum = log_add(sum, weight + log); }
  static Value scaled(Value log, Value scale) { return log + scale; }
  static double log_mean(Value sum, double weights) { return sum - std::log(weights); }
};

/// An AxisBlur in a domain's numbers.
template <typename Domain>
struct BlurIn {
  explicit BlurIn(const AxisBlur& axis)
      : reach((axis.reach() + BlockRun::side - 1) / BlockRun::side) {
    for (const double of : axis.weight) {
      weight.push_back(Domain::weight(of));
    }
    for (const double of : axis.scale) {
      scale.push_back(Domain::weight(of));
    }
  }

  int places() const { return static_cast<int>(scale.size()); }
  int blocks() const { return (places() + BlockRun::side - 1) / BlockRun::side; }

  int reach;  ///< in blocks
  std::vector<typename Domain::Value> weight;
  std::vector<typename Domain::Value> scale;
};

/// Adds up neighbours by their distance's weight.
template <typename Domain, typename Value = typename Domain::Value>
void blur(const Value* from, Value* __restrict to, int count, std::ptrdiff_t stride,
          const std::vector<Value>& weights) {
  for (int i = 0; i < count; ++i) {
    to[i] = Domain::scaled(from[i], weights[0]);
  }
  for (std::size_t k = 1; k < weights.size(); ++k) {
    const Value weight = weights[k];
    const Value* const below = from - static_cast<std::ptrdiff_t>(k) * stride;
    const Value* const above = from + static_cast<std::ptrdiff_t>(k) * stride;
    for (int i = 0; i < count; ++i) {
      Domain::add(to[i], weight, below[i]);
      Domain::add(to[i], weight, above[i]);
    }
  }
}

/// One theta's likelihoods, blurred along y and x at the blocks that were asked for.
template <typename Domain>
struct BlurredPlane {
  using Value = typename Domain::Value;

  double reference =
      -std::numeric_limits<double>::infinity();  ///< log of the largest before the blur, in nats
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

/// @param range around the asked blocks
/// @param several_bins places are tiles of more than one bin: a turn moves one to between four
template <typename Domain>
BlurredPlane<Domain> blurred_plane(int theta, const BlockRange& range,
                                   std::span<const BlockRange> asked, const BlurIn<Domain>& blur_x,
                                   const BlurIn<Domain>& blur_y, bool several_bins,
                                   const PlaceSource<typename Domain::Value>& source) {
  using Value = typename Domain::Value;
  // A block more on every BlockRun::side, since taps lie between places.
  const int x_margin = std::max(1, blur_x.reach);
  const int y_margin = std::max(1, blur_y.reach);
  const BlockRange window{range.x_first - x_margin, range.x_end + x_margin,
                          range.y_first - y_margin, range.y_end + y_margin};
  BlockSet wanted(window);
  for (const BlockRange& blocks : asked) {
    wanted.add(blocks);
  }
  const BlockSet along_x =
      wanted.with_neighbours(blur_x.reach, 0, blur_x.blocks(), blur_y.blocks());
  const std::vector<BlockRun> sources =
      along_x.with_neighbours(0, blur_y.reach, blur_x.blocks(), blur_y.blocks()).runs(theta);

  BlurredPlane<Domain> plane{.pitch = BlockRun::side * (window.x_end - window.x_first),
                             .x = BlockRun::side * window.x_first,
                             .y = BlockRun::side * window.y_first,
                             .height = BlockRun::side * (window.y_end - window.y_first)};
  std::vector<Value> likelihood(static_cast<std::size_t>(plane.pitch * plane.height),
                                Domain::nothing);
  const PlaceRows<Value> rows = plane.rows(likelihood);
  const auto for_rows = [](std::span<const BlockRun> runs, const auto& visit) {
    for (const BlockRun& run : runs) {
      for (int y = BlockRun::side * run.y; y < BlockRun::side * (run.y + 1); ++y) {
        visit(BlockRun::side * run.x, y, BlockRun::side * run.count);
      }
    }
  };
  constexpr auto no_bin = -std::numeric_limits<Value>::infinity();
  for_rows(sources, [&](int x, int y, int count) { std::fill_n(rows.at(x, y), count, no_bin); });
  source(sources, rows);
  Value largest = no_bin;
  for_rows(sources, [&](int x, int y, int count) {
    largest = std::max(largest, *std::max_element(rows.at(x, y), rows.at(x, y) + count));
  });
  plane.reference = largest;
  for_rows(sources, [&](int x, int y, int count) {
    Value* const row = rows.at(x, y);
    if constexpr (Domain::bounds) {
      Domain::of_logs(row, count, largest);
    } else {
      for (int i = 0; i < count; ++i) {
        row[i] = row[i] == no_bin ? Domain::nothing : Domain::of_log(row[i] - largest);
      }
    }
  });

  std::vector<Value> along_y(likelihood.size(), Domain::nothing);
  const PlaceRows<Value> middle = plane.rows(along_y);
  for_rows(along_x.runs(theta), [&](int x, int y, int count) {
    if (y < blur_y.places()) {
      Value* const row = middle.at(x, y);
      blur<Domain>(rows.at(x, y), row, count, plane.pitch, blur_y.weight);
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
    const int inside = std::min(count, blur_x.places() - x);
    blur<Domain>(middle.at(x, y), row, inside, 1, blur_x.weight);
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
