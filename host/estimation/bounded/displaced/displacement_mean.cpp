#include "estimation/bounded/displaced/displacement_mean.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "estimation/bounded/log_sum.hpp"
#include "estimation/bounded/parallel_for.hpp"

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = BlockRun::side;

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
  /// polynomial, which compilers turn into vectors.
  static Value of_log(Value nats) {
    const Value exponent = std::max(nats, -80.0F) * 1.44269504F;
    const auto whole = static_cast<std::int32_t>(exponent - 0.5F);
    const Value f = exponent - static_cast<Value>(whole);
    Value p = 0.001112550962716341F;
    for (const Value term : {0.009666282683610916F, 0.05557400360703468F, 0.24022351205348969F,
                             0.693142831325531F, 1.0F}) {
      p = p * f + term;
    }
    return std::bit_cast<Value>(std::bit_cast<std::int32_t>(p) + (whole << 23));
  }
  static Value weight(double weight) { return static_cast<Value>(weight); }
  static Value factor(double nats) { return static_cast<Value>(std::exp(nats)); }
  static void add(Value& sum, Value weight, Value likelihood) { sum += weight * likelihood; }
  static void widen(Value& widest, Value likelihood) { widest = std::max(widest, likelihood); }
  static Value scaled(Value likelihood, Value scale) { return likelihood * scale; }
  /// Log of the sum over the weights of its terms.
  static double log_mean(Value sum, double weights) {
    return std::log(sum / static_cast<Value>(weights) + vanished);
  }
  static double log(Value sum) { return std::log(sum); }
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
  static void widen(Value& sum, Value likelihood) { sum += likelihood; }
  static Value scaled(Value likelihood, Value scale) { return likelihood * scale; }
  static double log_mean(Value sum, double weights) { return std::log(sum / weights); }
  static double log(Value sum) { return std::log(sum); }
};

/// Likelihoods of bins by their logs, for those that float64 does not hold.
struct BinLogs {
  using Value = double;
  static constexpr Value nothing = -infinity;
  static constexpr bool bounds = false;
  static constexpr double least = -infinity;

  static Value of_log(Value nats) { return nats; }
  static Value weight(double weight) { return std::log(weight); }
  static Value factor(double nats) { return nats; }
  static void add(Value& sum, Value weight, Value log) { sum = log_add(sum, weight + log); }
  static void widen(Value& sum, Value log) { sum = log_add(sum, log); }
  static Value scaled(Value log, Value scale) { return log + scale; }
  static double log_mean(Value sum, double weights) { return sum - std::log(weights); }
  static double log(Value sum) { return sum; }
};

/// Blocks [first, end) along each axis.
struct BlockRange {
  int x_first = std::numeric_limits<int>::max();
  int x_end = 0;
  int y_first = std::numeric_limits<int>::max();
  int y_end = 0;

  bool empty() const { return x_first >= x_end || y_first >= y_end; }
  void take_in(const BlockRange& other) {
    x_first = std::min(x_first, other.x_first);
    x_end = std::max(x_end, other.x_end);
    y_first = std::min(y_first, other.y_first);
    y_end = std::max(y_end, other.y_end);
  }
};

int floor_quotient(int value, int by) { return value >= 0 ? value / by : -((by - 1 - value) / by); }

/// Blocks of places along an axis.
int blocks_of(const AxisBlur& axis) {
  return (static_cast<int>(axis.scale.size()) + side - 1) / side;
}

/// Places by which a tap moves a place's first bin, rounded down.
glm::ivec2 places_of(const Tap& tap, int bins) {
  return {floor_quotient(tap.bins.x, bins), floor_quotient(tap.bins.y, bins)};
}

/// The blocks that a tap takes for a run, as far as the region reaches.
BlockRange blocks_taken(const Tap& tap, const BlockRun& run, const PlaceWeights& weights) {
  const glm::ivec2 moved = places_of(tap, weights.bins);
  // One place more: the tap lies between places.
  return {.x_first = std::max(0, floor_quotient(side * run.x + moved.x, side)),
          .x_end = std::min(blocks_of(weights.x),
                            floor_quotient(side * (run.x + run.count) + moved.x, side) + 1),
          .y_first = std::max(0, floor_quotient(side * run.y + moved.y, side)),
          .y_end = std::min(blocks_of(weights.y),
                            floor_quotient(side * (run.y + 1) + moved.y, side) + 1)};
}

/// A part of one theta's blocks.
class BlockSet {
 public:
  explicit BlockSet(const BlockRange& range)
      : range_(range),
        width_(range.x_end - range.x_first),
        in_(static_cast<std::size_t>(width_) * (range.y_end - range.y_first)) {}

  void add(const BlockRange& blocks) {
    for (int y = blocks.y_first; y < blocks.y_end; ++y) {
      std::fill(at(blocks.x_first, y), at(blocks.x_first, y) + (blocks.x_end - blocks.x_first), 1);
    }
  }
  /// All blocks within so many of these, as far as this set's range and the axes reach.
  BlockSet widened(int x_blocks, int y_blocks, int x_count, int y_count) const {
    BlockSet wide(range_);
    for (const BlockRun& run : runs(0)) {
      wide.add({.x_first = std::max({range_.x_first, 0, run.x - x_blocks}),
                .x_end = std::min({range_.x_end, x_count, run.x + run.count + x_blocks}),
                .y_first = std::max({range_.y_first, 0, run.y - y_blocks}),
                .y_end = std::min({range_.y_end, y_count, run.y + 1 + y_blocks})});
    }
    return wide;
  }
  std::vector<BlockRun> runs(int theta) const {
    std::vector<BlockRun> runs;
    for (int y = range_.y_first; y < range_.y_end; ++y) {
      for (int x = range_.x_first; x < range_.x_end; ++x) {
        if (*at(x, y) != 0) {
          append_block(theta, y, x, runs);
        }
      }
    }
    return runs;
  }

 private:
  std::vector<std::uint8_t>::const_iterator at(int x, int y) const {
    return in_.begin() + std::ptrdiff_t{y - range_.y_first} * width_ + (x - range_.x_first);
  }
  std::vector<std::uint8_t>::iterator at(int x, int y) {
    return in_.begin() + std::ptrdiff_t{y - range_.y_first} * width_ + (x - range_.x_first);
  }

  BlockRange range_;
  int width_;
  std::vector<std::uint8_t> in_;  ///< [y, x]
};

/// An AxisBlur in a domain's numbers.
template <typename Domain>
struct BlurIn {
  explicit BlurIn(const AxisBlur& axis) : reach((axis.reach() + side - 1) / side) {
    for (const double of : axis.weight) {
      weight.push_back(Domain::weight(of));
    }
    for (const double of : axis.scale) {
      scale.push_back(Domain::weight(of));
    }
  }

  int places() const { return static_cast<int>(scale.size()); }
  int blocks() const { return (places() + side - 1) / side; }

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
struct Plane {
  using Value = typename Domain::Value;

  double reference = -infinity;  ///< log of the largest before the blur, in nats
  std::ptrdiff_t pitch = 0;
  int x = 0;  ///< of the first place
  int y = 0;
  int height = 0;
  std::vector<Value> blurred;  ///< [y, x] relative to the reference; nothing outside the region
  /// Of tiles the largest of a place, the next one along x, and those above both; of bins the sum
  /// of a place and its eight neighbours.
  std::vector<Value> wide;

  PlaceRows<Value> rows(std::vector<Value>& values) const { return {values.data(), pitch, x, y}; }
};

template <typename Domain>
std::vector<typename Domain::Value> widened(const std::vector<typename Domain::Value>& from,
                                            std::ptrdiff_t stride) {
  std::vector<typename Domain::Value> wide = from;
  const auto size = static_cast<std::ptrdiff_t>(from.size());
  const auto take = [&](std::ptrdiff_t distance) {
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, -distance);
    const std::ptrdiff_t end = std::min(size, size - distance);
    for (std::ptrdiff_t i = first; i < end; ++i) {
      Domain::widen(wide[i], from[i + distance]);
    }
  };
  take(stride);
  if (!Domain::bounds) {
    take(-stride);
  }
  return wide;
}

/// @param range around the asked blocks
template <typename Domain>
Plane<Domain> blurred_plane(int theta, const BlockRange& range, std::span<const BlockRange> asked,
                            const BlurIn<Domain>& blur_x, const BlurIn<Domain>& blur_y, bool wide,
                            const PlaceSource<typename Domain::Value>& source) {
  using Value = typename Domain::Value;
  // A block more on every side, since taps lie between places.
  const int x_margin = std::max(1, blur_x.reach);
  const int y_margin = std::max(1, blur_y.reach);
  const BlockRange window{range.x_first - x_margin, range.x_end + x_margin,
                          range.y_first - y_margin, range.y_end + y_margin};
  BlockSet wanted(window);
  for (const BlockRange& blocks : asked) {
    wanted.add(blocks);
  }
  const BlockSet along_x = wanted.widened(blur_x.reach, 0, blur_x.blocks(), blur_y.blocks());
  const std::vector<BlockRun> sources =
      along_x.widened(0, blur_y.reach, blur_x.blocks(), blur_y.blocks()).runs(theta);

  Plane<Domain> plane{.pitch = side * (window.x_end - window.x_first),
                      .x = side * window.x_first,
                      .y = side * window.y_first,
                      .height = side * (window.y_end - window.y_first)};
  std::vector<Value> likelihood(static_cast<std::size_t>(plane.pitch * plane.height),
                                Domain::nothing);
  const PlaceRows<Value> rows = plane.rows(likelihood);
  const auto for_rows = [](std::span<const BlockRun> runs, const auto& visit) {
    for (const BlockRun& run : runs) {
      for (int y = side * run.y; y < side * (run.y + 1); ++y) {
        visit(side * run.x, y, side * run.count);
      }
    }
  };
  constexpr auto no_bin = static_cast<Value>(-infinity);
  for_rows(sources, [&](int x, int y, int count) { std::fill_n(rows.at(x, y), count, no_bin); });
  source(sources, rows);
  Value largest = no_bin;
  for_rows(sources, [&](int x, int y, int count) {
    largest = std::max(largest, *std::max_element(rows.at(x, y), rows.at(x, y) + count));
  });
  plane.reference = largest;
  for_rows(sources, [&](int x, int y, int count) {
    Value* const row = rows.at(x, y);
    for (int i = 0; i < count; ++i) {
      row[i] = row[i] == no_bin ? Domain::nothing : Domain::of_log(row[i] - largest);
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
  for_rows(wanted.runs(theta), [&](int x, int y, int count) {
    Value* const row = result.at(x, y);
    const int inside = std::min(count, blur_x.places() - x);
    blur<Domain>(middle.at(x, y), row, inside, 1, blur_x.weight);
    for (int i = 0; i < inside; ++i) {
      row[i] = Domain::scaled(row[i], blur_x.scale[x + i]);
    }
  });
  if (wide) {
    plane.wide = widened<Domain>(widened<Domain>(plane.blurred, 1), plane.pitch);
  }
  return plane;
}

/// The least part of a tap's bilinear weights that lies inside the region, for any bin of a place.
double weight_inside(int place, int bins, const Axis& axis, int moved, double fraction) {
  const auto inside = [&](int at) { return at >= 0 && at < axis.count; };
  const auto of_bin = [&](int bin) {
    return (inside(bin + moved) ? 1.0 - fraction : 0.0) +
           (inside(bin + moved + 1) ? fraction : 0.0);
  };
  // It grows and then falls along the axis: least is that of the first or of the last.
  return std::min(of_bin(place * bins), of_bin(std::min((place + 1) * bins, axis.count) - 1));
}

/// Adds up the planes of a run's taps.
template <typename Domain>
class TapSum {
 public:
  using Value = typename Domain::Value;

  TapSum(std::span<const Tap> taps, const std::vector<Plane<Domain>>& planes,
         const PlaceWeights& weights, double fraction_error)
      : taps_(taps), planes_(planes), weights_(weights), fraction_error_(fraction_error) {
    for (const Tap& tap : taps) {
      reference_ = std::max(reference_, planes[tap.theta].reference);
    }
  }

  /// @param log_mean,error [block, y, x]
  /// @returns false where the domain holds a sum too inexactly
  bool add_up(const BlockRun& run, double* log_mean, double* error) {
    width_ = side * run.count;
    const std::size_t size = static_cast<std::size_t>(width_) * side;
    sums_.assign(size, Domain::nothing);
    wide_.assign(size, Domain::nothing);
    inside_.assign(size, 0.0);
    wholly_inside_ = 0.0;
    const int bins = weights_.bins;
    for (const Tap& tap : taps_) {
      add_weights_inside(tap, run);
      const Plane<Domain>& plane = planes_[tap.theta];
      if (plane.reference == -infinity) {
        continue;
      }
      const glm::ivec2 moved = places_of(tap, bins);
      if (bins > 1) {
        add(plane, plane.wide, run, moved, tap.weight, -1, sums_);
        continue;
      }
      const glm::dvec2 behind = tap.fraction;
      const glm::dvec2 before = 1.0 - behind;
      for (const auto& [corner, part] : {std::pair{glm::ivec2(0, 0), before.x * before.y},
                                         {{1, 0}, behind.x * before.y},
                                         {{0, 1}, before.x * behind.y},
                                         {{1, 1}, behind.x * behind.y}}) {
        add(plane, plane.blurred, run, moved + corner, tap.weight * part, 0, sums_);
      }
      if (!Domain::bounds && fraction_error_ > 0.0) {
        add(plane, plane.wide, run, moved, tap.weight, -1, wide_);
      }
    }
    return take(run, log_mean, error);
  }

 private:
  /// Adds values that lie `moved` away, as far as they lie behind `first` in the region.
  void add(const Plane<Domain>& plane, const std::vector<Value>& values, const BlockRun& run,
           const glm::ivec2& moved, double weight, int first, std::vector<Value>& sums) const {
    if (weight == 0.0) {
      return;
    }
    const Value of_tap =
        Domain::scaled(Domain::weight(weight), Domain::factor(plane.reference - reference_));
    const int x = side * run.x + moved.x;
    const int begin = std::max({0, first - x, plane.x - x});
    const int end = std::min({width_, static_cast<int>(weights_.x.scale.size()) - x,
                              plane.x + static_cast<int>(plane.pitch) - x});
    for (int j = 0; j < side; ++j) {
      const int y = side * run.y + j + moved.y;
      if (y < std::max(first, plane.y) ||
          y >= std::min(static_cast<int>(weights_.y.scale.size()), plane.y + plane.height)) {
        continue;
      }
      const Value* const from = values.data() + (y - plane.y) * plane.pitch + (x - plane.x);
      Value* const __restrict to = sums.data() + std::ptrdiff_t{j} * width_;
      for (int i = begin; i < end; ++i) {
        Domain::add(to[i], of_tap, from[i]);
      }
    }
  }

  void add_weights_inside(const Tap& tap, const BlockRun& run) {
    const PoseLattice& lattice = weights_.touch.lattice();
    const auto all_inside = [&](int first, int count, const Axis& axis, int moved,
                                double fraction) {
      const int end = std::min((first + count) * weights_.bins, axis.count) + moved;
      return first * weights_.bins + moved >= 0 && end + (fraction > 0.0 ? 1 : 0) <= axis.count;
    };
    if (all_inside(side * run.x, width_, lattice.x_mm, tap.bins.x, tap.fraction.x) &&
        all_inside(side * run.y, side, lattice.y_mm, tap.bins.y, tap.fraction.y)) {
      wholly_inside_ += tap.weight;
      return;
    }
    of_columns_.clear();
    for (int i = 0; i < width_; ++i) {
      of_columns_.push_back(
          weight_inside(side * run.x + i, weights_.bins, lattice.x_mm, tap.bins.x, tap.fraction.x));
    }
    for (int j = 0; j < side; ++j) {
      const double of_row = tap.weight * weight_inside(side * run.y + j, weights_.bins,
                                                       lattice.y_mm, tap.bins.y, tap.fraction.y);
      double* const __restrict to = inside_.data() + std::ptrdiff_t{j} * width_;
      for (int i = 0; i < width_; ++i) {
        to[i] += of_row * of_columns_[i];
      }
    }
  }

  bool take(const BlockRun& run, double* log_mean, double* error) const {
    const int columns = static_cast<int>(weights_.x.scale.size()) - side * run.x;
    const int rows = static_cast<int>(weights_.y.scale.size()) - side * run.y;
    for (int block = 0; block < run.count; ++block) {
      for (int j = 0; j < side; ++j) {
        for (int i = side * block; i < side * (block + 1); ++i, ++log_mean, ++error) {
          if (i >= columns || j >= rows) {
            *log_mean = -infinity;
            continue;
          }
          const std::size_t place = static_cast<std::size_t>(j) * width_ + i;
          if (sums_[place] < Domain::least) {
            return false;
          }
          *log_mean = Domain::log_mean(sums_[place], inside_[place] + wholly_inside_) + reference_;
          if (!Domain::bounds && fraction_error_ > 0.0) {
            // Each of two fractions may change a neighbour's weight by so much.
            const double log_part = std::log(2.0 * fraction_error_) + Domain::log(wide_[place]) -
                                    Domain::log(sums_[place]);
            *error = log_add(0.0, log_part);
          }
        }
      }
    }
    return true;
  }

  std::span<const Tap> taps_;
  const std::vector<Plane<Domain>>& planes_;  ///< [theta]
  const PlaceWeights& weights_;
  double fraction_error_;
  double reference_ = -infinity;  ///< of the sums, in nats
  int width_ = 0;                 ///< of a run's rows
  std::vector<Value> sums_;       ///< [y, x] of the run
  std::vector<Value> wide_;
  std::vector<double> inside_;  ///< [y, x] weights of taps that lie partly inside the region
  std::vector<double> of_columns_;
  double wholly_inside_ = 0.0;  ///< of those that lie inside for all of the run's places
};

/// @returns false where the domain holds a mean too inexactly
template <typename Domain>
bool average(const PlaceWeights& weights, const glm::dvec2& sensor_from_pivot_mm,
             std::span<const BlockRun> targets, const PlaceSource<typename Domain::Value>& source,
             DisplacedMeans& means) {
  const auto thetas = static_cast<std::size_t>(weights.touch.lattice().theta_rad.count);
  struct Target {
    std::size_t first = 0;  ///< run
    std::size_t end = 0;
    std::size_t place = 0;  ///< of the first run's results
    std::vector<Tap> taps = {};
  };
  std::vector<Target> of_theta;
  std::size_t places = 0;
  std::vector<BlockRange> ranges(thetas);
  std::vector<std::vector<BlockRange>> asked(thetas);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    if (i == 0 || targets[i].theta != targets[i - 1].theta) {
      of_theta.push_back(
          {i, i, places, weights.touch.taps(targets[i].theta, sensor_from_pivot_mm)});
    }
    of_theta.back().end = i + 1;
    places += static_cast<std::size_t>(targets[i].count) * BlockRun::places;
    for (const Tap& tap : of_theta.back().taps) {
      const BlockRange taken = blocks_taken(tap, targets[i], weights);
      if (!taken.empty()) {
        ranges[tap.theta].take_in(taken);
        asked[tap.theta].push_back(taken);
      }
    }
  }
  means.log_mean.resize(places);
  means.error.resize(places);
  std::vector<Plane<Domain>> planes(thetas);
  const BlurIn<Domain> blur_x(weights.x);
  const BlurIn<Domain> blur_y(weights.y);
  parallel_for(thetas, [&](std::size_t theta) {
    if (!asked[theta].empty()) {
      planes[theta] =
          blurred_plane<Domain>(static_cast<int>(theta), ranges[theta], asked[theta], blur_x,
                                blur_y, !Domain::bounds || weights.bins > 1, source);
    }
  });
  std::atomic<bool> holds = true;
  const double fraction_error = weights.touch.fraction_error(sensor_from_pivot_mm);
  parallel_for(of_theta.size(), [&](std::size_t i) {
    const Target& target = of_theta[i];
    TapSum<Domain> sum(target.taps, planes, weights, fraction_error);
    std::size_t place = target.place;
    for (const BlockRun& run : targets.subspan(target.first, target.end - target.first)) {
      if (!sum.add_up(run, means.log_mean.data() + place, means.error.data() + place)) {
        holds = false;
        return;
      }
      place += static_cast<std::size_t>(run.count) * BlockRun::places;
    }
  });
  return holds;
}

/// Terms of the sums that make up a mean.
double terms_of(const PlaceWeights& weights) {
  return 2.0 * (weights.x.steps + weights.y.steps) +
         4.0 * (2.0 * weights.touch.theta_steps() + 1.0);
}

}  // namespace

void append_block(int theta, int y, int x, std::vector<BlockRun>& runs) {
  if (!runs.empty() && runs.back().theta == theta && runs.back().y == y &&
      runs.back().x + runs.back().count == x) {
    ++runs.back().count;
  } else {
    runs.push_back({theta, y, x, 1});
  }
}

DisplacementMean::DisplacementMean(const DisplacementWeights& weights, int bins)
    : weights_{weights, bins, AxisBlur(weights.lattice().x_mm, weights.sd().mm, bins),
               AxisBlur(weights.lattice().y_mm, weights.sd().mm, bins)} {}

std::vector<double> DisplacementMean::bounds(const glm::dvec2& sensor_from_pivot_mm,
                                             std::span<const BlockRun> targets,
                                             const PlaceSource<float>& source) const {
  DisplacedMeans found;
  average<TileLikelihoods>(weights_, sensor_from_pivot_mm, targets, source, found);
  // Each term rounds by a few units, and so do exponentials and the logarithm.
  const double rounding = 1e-3 + 0x1p-22 * terms_of(weights_);
  for (double& log_mean : found.log_mean) {
    log_mean += rounding;
  }
  return std::move(found.log_mean);
}

DisplacedMeans DisplacementMean::means(const glm::dvec2& sensor_from_pivot_mm,
                                       std::span<const BlockRun> targets,
                                       const PlaceSource<double>& source) const {
  DisplacedMeans found;
  if (!average<BinLikelihoods>(weights_, sensor_from_pivot_mm, targets, source, found)) {
    average<BinLogs>(weights_, sensor_from_pivot_mm, targets, source, found);
  }
  return found;
}

double DisplacementMean::mean_error() const {
  // Weights of three Gaussians: exp(-d^2 / 2), d^2 / 2 at most some 8, rounds by 40 units; then
  // norms, exponentials and the logarithm; and a unit for each term of the sums.
  constexpr double of_weights = 256.0;
  return (of_weights + 2.0 * terms_of(weights_)) * 0x1p-53;
}

}  // namespace palpate
