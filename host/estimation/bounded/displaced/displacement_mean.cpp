#include "estimation/bounded/displaced/displacement_mean.hpp"

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <utility>

#include "estimation/bounded/displaced/blurred_plane.hpp"
#include "estimation/parallel_for.hpp"

// The mean of a touch's likelihood f over displacements, at a place p of one theta:
//
//   mean(p) = sum over taps of w B(p + d) / sum over taps of w inside(p + d)
//
// A tap (see DisplacementWeights) takes with weight w from one theta what lies d away, where the
// turn moves the place to. B is f at this theta, blurred along y and then along x, each time over
// the weights inside the region. Between bins, B is bilinear, and inside() the part of the bilinear
// weights that lies in the region. Places that are tiles of several bins take upper bounds: f the
// largest likelihood of a tile, the blurs' weights those of AxisBlur, B the largest of the four
// tiles that p + d lies between, and inside() the least of any bin.

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = BlockRun::side;

int floor_quotient(int value, int by) { return value >= 0 ? value / by : -((by - 1 - value) / by); }

/// Places by which a tap moves a place's first bin, rounded down.
glm::ivec2 places_of(const Tap& tap, int bins) {
  return {floor_quotient(tap.bins.x, bins), floor_quotient(tap.bins.y, bins)};
}

/// The blocks that a tap takes for a run, as far as the region reaches.
BlockRange blocks_taken(const Tap& tap, const BlockRun& run, const DisplacementMean& weights) {
  const glm::ivec2 moved = places_of(tap, weights.bins);
  // One place more: the tap lies between places.
  return {.x_first = std::max(0, floor_quotient(side * run.x + moved.x, side)),
          .x_end = std::min(blocks_of(weights.x),
                            floor_quotient(side * (run.x + run.count) + moved.x, side) + 1),
          .y_first = std::max(0, floor_quotient(side * run.y + moved.y, side)),
          .y_end = std::min(blocks_of(weights.y),
                            floor_quotient(side * (run.y + 1) + moved.y, side) + 1)};
}

/// The least part of a tap's bilinear weights that lies inside the region, for any bin of a place.
double weight_inside(int place, int bins, const Axis& axis, int moved, double fraction) {
  const int end = std::min((place + 1) * bins, axis.count);
  // It grows and then falls along the axis: least is that of the first or of the last.
  return std::min(part_inside(axis, place * bins + moved, fraction),
                  part_inside(axis, end - 1 + moved, fraction));
}

/// Adds up the planes of a run's taps.
template <typename Domain>
class TapSum {
 public:
  using Value = typename Domain::Value;

  TapSum(std::span<const Tap> taps, const std::vector<BlurredPlane<Domain>>& planes,
         const DisplacementMean& weights)
      : taps_(taps), planes_(planes), weights_(weights) {
    for (const Tap& tap : taps) {
      reference_ = std::max(reference_, planes[tap.theta].reference);
    }
    for (const Tap& tap : taps) {
      factors_.push_back(Domain::factor(planes[tap.theta].reference - reference_));
    }
  }

  /// @param log_mean [block, y, x]
  /// @returns false where the domain holds a sum too inexactly
  bool add_up(const BlockRun& run, double* log_mean) {
    width_ = side * run.count;
    const std::size_t size = static_cast<std::size_t>(width_) * side;
    sums_.assign(size, Domain::nothing);
    inside_.assign(size, 0.0);
    wholly_inside_ = 0.0;
    const int bins = weights_.bins;
    for (std::size_t i = 0; i < taps_.size(); ++i) {
      const Tap& tap = taps_[i];
      add_weights_inside(tap, run);
      const BlurredPlane<Domain>& plane = planes_[tap.theta];
      if (plane.reference == -infinity) {
        continue;
      }
      const glm::ivec2 moved = places_of(tap, bins);
      if (bins > 1) {
        add(plane, run, moved, weighted(tap.weight, i), -1);
        continue;
      }
      const glm::dvec2 behind = tap.fraction;
      const glm::dvec2 before = 1.0 - behind;
      for (const auto& [corner, part] : {std::pair{glm::ivec2(0, 0), before.x * before.y},
                                         {{1, 0}, behind.x * before.y},
                                         {{0, 1}, before.x * behind.y},
                                         {{1, 1}, behind.x * behind.y}}) {
        add(plane, run, moved + corner, weighted(tap.weight * part, i), 0);
      }
    }
    return take(run, log_mean);
  }

 private:
  /// A weight of a tap, for what is relative to its plane's reference.
  Value weighted(double weight, std::size_t tap) const {
    return Domain::scaled(Domain::weight(weight), factors_[tap]);
  }

  /// Adds values that lie `moved` away, as far as they lie behind `first` in the region.
  void add(const BlurredPlane<Domain>& plane, const BlockRun& run, const glm::ivec2& moved,
           Value of_tap, int first) {
    if (of_tap == Domain::nothing) {
      return;
    }
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
      const Value* const from = plane.blurred.data() + (y - plane.y) * plane.pitch + (x - plane.x);
      Value* const __restrict to = sums_.data() + std::ptrdiff_t{j} * width_;
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

  bool take(const BlockRun& run, double* log_mean) const {
    const int columns = static_cast<int>(weights_.x.scale.size()) - side * run.x;
    const int rows = static_cast<int>(weights_.y.scale.size()) - side * run.y;
    for (int block = 0; block < run.count; ++block) {
      for (int j = 0; j < side; ++j) {
        for (int i = side * block; i < side * (block + 1); ++i, ++log_mean) {
          if (i >= columns || j >= rows) {
            *log_mean = -infinity;
            continue;
          }
          const std::size_t place = static_cast<std::size_t>(j) * width_ + i;
          if (sums_[place] < Domain::least) {
            return false;
          }
          *log_mean = Domain::log_mean(sums_[place], inside_[place] + wholly_inside_) + reference_;
        }
      }
    }
    return true;
  }

  std::span<const Tap> taps_;
  const std::vector<BlurredPlane<Domain>>& planes_;  ///< [theta]
  const DisplacementMean& weights_;
  double reference_ = -infinity;  ///< of the sums, in nats
  int width_ = 0;                 ///< of a run's rows
  std::vector<Value> factors_;    ///< [tap] of its plane's reference
  std::vector<Value> sums_;       ///< [y, x] of the run
  std::vector<double> inside_;    ///< [y, x] weights of taps that lie partly inside the region
  std::vector<double> of_columns_;
  double wholly_inside_ = 0.0;  ///< of those that lie inside for all of the run's places
};

/// @returns nothing where the domain holds a mean too inexactly
template <typename Domain>
std::optional<std::vector<double>> average(const DisplacementMean& weights,
                                           const glm::dvec2& sensor_from_pivot_mm,
                                           std::span<const BlockRun> targets,
                                           const PlaceSource<typename Domain::Value>& source) {
  /// The targets of one theta.
  struct Target {
    std::size_t first = 0;  ///< run
    std::size_t end = 0;
    std::size_t place = 0;  ///< of the first run's results
    std::vector<Tap> taps = {};
  };
  const auto thetas = static_cast<std::size_t>(weights.touch.lattice().theta_rad.count);
  std::vector<Target> of_theta;
  std::size_t places = 0;
  std::vector<std::vector<BlockRange>> asked(thetas);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const BlockRun& run = targets[i];
    if (i == 0 || run.theta != targets[i - 1].theta) {
      of_theta.push_back({i, i, places, weights.touch.taps(run.theta, sensor_from_pivot_mm)});
    }
    of_theta.back().end = i + 1;
    places += static_cast<std::size_t>(run.count) * BlockRun::places;
    for (const Tap& tap : of_theta.back().taps) {
      if (const BlockRange taken = blocks_taken(tap, run, weights); !taken.empty()) {
        asked[tap.theta].push_back(taken);
      }
    }
  }
  std::vector<BlurredPlane<Domain>> planes(thetas);
  const BlurIn<Domain> blur_x(weights.x);
  const BlurIn<Domain> blur_y(weights.y);
  parallel_for(thetas, [&](std::size_t theta) {
    if (!asked[theta].empty()) {
      planes[theta] = blurred_plane<Domain>(static_cast<int>(theta), asked[theta], blur_x, blur_y,
                                            weights.bins > 1, source);
    }
  });
  std::vector<double> means(places);
  std::atomic<bool> holds = true;
  parallel_for(of_theta.size(), [&](std::size_t i) {
    const Target& target = of_theta[i];
    TapSum<Domain> sum(target.taps, planes, weights);
    std::size_t place = target.place;
    for (const BlockRun& run : targets.subspan(target.first, target.end - target.first)) {
      if (!sum.add_up(run, means.data() + place)) {
        holds = false;
        return;
      }
      place += static_cast<std::size_t>(run.count) * BlockRun::places;
    }
  });
  return holds ? std::optional(std::move(means)) : std::nullopt;
}

/// Terms of the sums that make up a mean.
double terms_of(const DisplacementMean& weights) {
  return 2.0 * (weights.x.steps + weights.y.steps) +
         4.0 * (2.0 * weights.touch.theta_steps() + 1.0);
}

}  // namespace

DisplacementMean::DisplacementMean(const DisplacementWeights& weights, int place_bins)
    : touch(weights),
      bins(place_bins),
      x(weights.lattice().x_mm, weights.sd().mm, place_bins),
      y(weights.lattice().y_mm, weights.sd().mm, place_bins) {}

std::vector<double> DisplacementMean::bounds(const glm::dvec2& sensor_from_pivot_mm,
                                             std::span<const BlockRun> targets,
                                             const PlaceSource<float>& source) const {
  std::vector<double> found =
      average<TileLikelihoods>(*this, sensor_from_pivot_mm, targets, source).value();
  // Each term rounds by a few units, and so do exponentials and the logarithm.
  const double rounding = 1e-3 + 0x1p-22 * terms_of(*this);
  for (double& log_mean : found) {
    log_mean += rounding;
  }
  return found;
}

std::vector<double> DisplacementMean::means(const glm::dvec2& sensor_from_pivot_mm,
                                            std::span<const BlockRun> targets,
                                            const PlaceSource<double>& source) const {
  auto found = average<BinLikelihoods>(*this, sensor_from_pivot_mm, targets, source);
  return found ? *std::move(found)
               : average<BinLogs>(*this, sensor_from_pivot_mm, targets, source).value();
}

double DisplacementMean::mean_error() const {
  // Weights of three Gaussians: exp(-d^2 / 2), d^2 / 2 at most some 8, rounds by 40 units; then
  // norms, exponentials and the logarithm; and a unit for each term of the sums.
  constexpr double of_weights = 256.0;
  return (of_weights + 2.0 * terms_of(*this)) * 0x1p-53;
}

}  // namespace palpate
