#include "estimation/bounded/moving/slip_mean.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "estimation/bounded/displaced/blurred_plane.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = BlockRun::side;
/// Blocks of a run whose sources are taken together.
constexpr int blocks_together = 4;

/// A bin's place, moved by so many bins, in whole bins and the rest.
struct MovedPlace {
  int bin;
  double fraction;

  MovedPlace(int from, double bins, int count, double fraction_error) {
    const double moved = std::floor(bins);
    fraction = bins - moved;
    // Farther than any lattice reaches, all places are outside.
    bin = from + static_cast<int>(std::clamp<double>(moved, -count - 1, count + 1));
    if (fraction > 1.0 - fraction_error) {
      ++bin;
      fraction = 0.0;
    }
  }
  bool beyond(int count) const { return bin < -1 || bin >= count; }
  double inside(int count) const {
    return (bin >= 0 ? 1.0 - fraction : 0.0) + (bin + 1 < count ? fraction : 0.0);
  }
};

}  // namespace

SlipMean::SlipMean(const DisplacementWeights& weights, const glm::dvec2& centroid_mm, int bins)
    : weights_(weights),
      bins_(bins),
      x_(weights.lattice().x_mm, weights.sd().mm, bins),
      y_(weights.lattice().y_mm, weights.sd().mm, bins) {
  const PoseLattice& lattice = weights.lattice();
  const Axis& x = lattice.x_mm;
  const Axis& y = lattice.y_mm;
  first_mm_ = glm::dvec2(x.centre(0), y.centre(0)) - centroid_mm;
  step_mm_ = {x.count > 1 ? x.step() : 0.0, y.count > 1 ? y.step() : 0.0};
  double widest = 0.0;
  for (int k = -weights.theta_steps(); k <= weights.theta_steps(); ++k) {
    const double alpha = k * lattice.theta_rad.step();
    // R(alpha) - 1.
    const double c = -2.0 * std::sin(alpha / 2.0) * std::sin(alpha / 2.0);
    const double s = std::sin(alpha);
    Turn& turn = turns_.emplace_back();
    if (x.count > 1) {
      turn.x = glm::dvec2(c, -s) / x.step();
    }
    if (y.count > 1) {
      turn.y = glm::dvec2(s, c) / y.step();
    }
    widest = std::max(
        {widest, std::abs(turn.x.x) + std::abs(turn.x.y), std::abs(turn.y.x) + std::abs(turn.y.y)});
  }
  // Sines of angles, their quotients by steps, the distance from the centroid, two products and two
  // sums: each within a unit or two of the largest terms.
  double farthest = 0.0;
  for (const double mm : {x.lower, x.upper, y.lower, y.upper, centroid_mm.x, centroid_mm.y}) {
    farthest = std::max(farthest, std::abs(mm));
  }
  fraction_error_ = std::min(32.0 * 0x1p-53 * widest * farthest, 0.5);
  for (int theta = 0; theta < lattice.theta_rad.count; ++theta) {
    taps_.push_back(weights.taps(theta, {0.0, 0.0}));
  }
  if (bins > 1) {
    find_sources();
  }
}

SlipMean::PlaceBox SlipMean::moved(const Turn& turn, const glm::ivec2& first,
                                   const glm::ivec2& last) const {
  PlaceBox box{.least = glm::dvec2(infinity), .most = glm::dvec2(-infinity)};
  for (const int i : {first.x, last.x}) {
    for (const int j : {first.y, last.y}) {
      const glm::dvec2 mm = first_mm_ + step_mm_ * glm::dvec2(i, j);
      const glm::dvec2 place(i + glm::dot(turn.x, mm), j + glm::dot(turn.y, mm));
      box.least = glm::min(box.least, place);
      box.most = glm::max(box.most, place);
    }
  }
  return box;
}

BlockRange SlipMean::blocks_taken(const Turn& turn, const BlockRun& run) const {
  const int bins = side * bins_;
  const PlaceBox box = moved(turn, {bins * run.x, bins * run.y},
                             {bins * (run.x + run.count) - 1, bins * (run.y + 1) - 1});
  const auto block = [&](double bin, int places) {
    return static_cast<int>(std::clamp<double>(std::floor(std::floor(bin) / bins), -1, places));
  };
  const auto blocks = [](int places) { return (places + side - 1) / side; };
  // A little more, for rounding; and the bin behind.
  return {.x_first = std::max(0, block(box.least.x - 1e-3, columns())),
          .x_end = std::min(blocks(columns()), block(box.most.x + 1.001, columns()) + 1),
          .y_first = std::max(0, block(box.least.y - 1e-3, rows())),
          .y_end = std::min(blocks(rows()), block(box.most.y + 1.001, rows()) + 1)};
}

template <typename Domain, typename Value>
std::vector<BlurredPlane<Domain>> SlipMean::blurred(std::span<const BlockRun> targets,
                                                    std::span<const Value> logs) const {
  std::vector<BlockRange> ranges(taps_.size());
  std::vector<std::vector<BlockRange>> asked(taps_.size());
  for (const BlockRun& run : targets) {
    for (int first = 0; first < run.count; first += blocks_together) {
      const BlockRun part{run.theta, run.y, run.x + first,
                          std::min(blocks_together, run.count - first)};
      for (const Tap& tap : taps_[run.theta]) {
        const BlockRange taken = blocks_taken(turn(tap), part);
        if (!taken.empty()) {
          ranges[tap.theta].take_in(taken);
          asked[tap.theta].push_back(taken);
        }
      }
    }
  }
  const int width = columns();
  const int height = rows();
  const auto source = [&](std::span<const BlockRun> runs, const PlaceRows<Value>& to) {
    for (const BlockRun& run : runs) {
      const int x = side * run.x;
      for (int y = side * run.y; y < std::min(side * (run.y + 1), height); ++y) {
        const Value* const from =
            logs.data() + (std::ptrdiff_t{run.theta} * height + y) * width + x;
        std::copy_n(from, std::min(side * run.count, width - x), to.at(x, y));
      }
    }
  };
  std::vector<BlurredPlane<Domain>> planes(taps_.size());
  const BlurIn<Domain> blur_x(x_);
  const BlurIn<Domain> blur_y(y_);
  const bool wide = !Domain::bounds && fraction_error_ > 0.0;
  parallel_for(planes.size(), [&](std::size_t theta) {
    if (!asked[theta].empty()) {
      planes[theta] = blurred_plane<Domain>(static_cast<int>(theta), ranges[theta], asked[theta],
                                            blur_x, blur_y, wide, source);
    }
  });
  return planes;
}

template std::vector<BlurredPlane<TileLikelihoods>> SlipMean::blurred<TileLikelihoods, float>(
    std::span<const BlockRun>, std::span<const float>) const;

template <typename Domain>
bool SlipMean::sum_turns(std::span<const BlockRun> targets, std::span<const double> log_belief,
                         std::span<double> log_mean, std::span<double> error, double& lost) const {
  const std::vector<BlurredPlane<Domain>> planes = blurred<Domain, double>(targets, log_belief);
  const int nx = columns();
  const int ny = rows();
  bool holds = true;
  std::mutex mutex;
  parallel_for(targets.size(), [&](std::size_t i) {
    const BlockRun& run = targets[i];
    const std::vector<Tap>& taps = taps_[run.theta];
    double reference = -infinity;
    for (const Tap& tap : taps) {
      reference = std::max(reference, planes[tap.theta].reference);
    }
    const int first = side * run.x;
    const int width = std::min(side * run.count, nx - first);
    std::vector<double> sums(width);
    std::vector<double> wide(width);
    std::vector<double> inside(width);
    double lost_here = -infinity;
    for (int y = side * run.y; y < std::min(side * (run.y + 1), ny); ++y) {
      std::ranges::fill(sums, Domain::nothing);
      std::ranges::fill(wide, Domain::nothing);
      std::ranges::fill(inside, 0.0);
      for (const Tap& tap : taps) {
        const BlurredPlane<Domain>& plane = planes[tap.theta];
        const bool empty = plane.reference == -infinity;
        const double of_tap = empty ? Domain::nothing
                                    : Domain::scaled(Domain::weight(tap.weight),
                                                     Domain::factor(plane.reference - reference));
        const double* const blurred = plane.blurred.data() - plane.y * plane.pitch - plane.x;
        if (tap.steps == 0) {
          for (int x = 0; x < width; ++x) {
            inside[x] += tap.weight;
            if (!empty) {
              Domain::add(sums[x], of_tap, blurred[y * plane.pitch + first + x]);
            }
          }
          continue;
        }
        const double* const around =
            fraction_error_ > 0.0 ? plane.wide.data() - plane.y * plane.pitch - plane.x : nullptr;
        const Turn& turned = turn(tap);
        for (int x = 0; x < width; ++x) {
          const glm::dvec2 mm = first_mm_ + step_mm_ * glm::dvec2(first + x, y);
          const MovedPlace u(first + x, glm::dot(turned.x, mm), nx, fraction_error_);
          const MovedPlace v(y, glm::dot(turned.y, mm), ny, fraction_error_);
          if (u.beyond(nx) || v.beyond(ny)) {
            continue;
          }
          inside[x] += tap.weight * u.inside(nx) * v.inside(ny);
          if (empty) {
            continue;
          }
          const std::ptrdiff_t at = v.bin * plane.pitch + u.bin;
          const auto add = [&](double part, std::ptrdiff_t corner) {
            if (part > 0.0) {
              Domain::add(sums[x], Domain::scaled(of_tap, Domain::weight(part)),
                          blurred[at + corner]);
            }
          };
          add((1.0 - u.fraction) * (1.0 - v.fraction), 0);
          add(u.fraction * (1.0 - v.fraction), 1);
          add((1.0 - u.fraction) * v.fraction, plane.pitch);
          add(u.fraction * v.fraction, plane.pitch + 1);
          if (fraction_error_ > 0.0) {
            Domain::add(wide[x], of_tap, around[at]);
          }
        }
      }
      const std::ptrdiff_t row = (std::ptrdiff_t{run.theta} * ny + y) * nx + first;
      for (int x = 0; x < width; ++x) {
        double& mean = log_mean[static_cast<std::size_t>(row + x)];
        double& wrong = error[static_cast<std::size_t>(row + x)];
        wrong = 0.0;
        if (!(sums[x] > Domain::least)) {
          mean = -infinity;
          if (Domain::least > 0.0) {
            lost_here = std::max(lost_here, std::log(Domain::least / inside[x]) + reference + 1e-6);
          }
          continue;
        }
        mean = Domain::log_mean(sums[x], inside[x]) + reference;
        if (fraction_error_ > 0.0) {
          // Each of two fractions may change a neighbour's weight by so much.
          wrong = log_add(
              0.0, std::log(2.0 * fraction_error_) + Domain::log(wide[x]) - Domain::log(sums[x]));
        }
      }
    }
    if (lost_here > -infinity) {
      const std::scoped_lock lock(mutex);
      lost = std::max(lost, lost_here);
      holds = false;
    }
  });
  return holds;
}

double SlipMean::means(std::span<const BlockRun> targets, std::span<const double> log_belief,
                       std::span<double> log_mean, std::span<double> error, bool by_logs) const {
  double lost = -infinity;
  if (!sum_turns<BinLikelihoods>(targets, log_belief, log_mean, error, lost) && by_logs) {
    lost = -infinity;
    sum_turns<BinLogs>(targets, log_belief, log_mean, error, lost);
  }
  return lost;
}

double SlipMean::mean_error() const {
  // Weights of three Gaussians: exp(-d^2 / 2), d^2 / 2 at most some 8, rounds by 40 units; then
  // norms, exponentials and the logarithm; and a unit for each term of the sums.
  constexpr double of_weights = 256.0;
  const double terms = 2.0 * (x_.steps + y_.steps) + 4.0 * static_cast<double>(turns_.size());
  return (of_weights + 2.0 * terms) * 0x1p-53;
}

std::vector<double> SlipMean::kept() const {
  const int nx = columns();
  const int ny = rows();
  const bool around = weights_.lattice().full_circle();
  std::vector<double> turned((around ? 1 : taps_.size()) * static_cast<std::size_t>(nx) * ny);
  for (std::size_t theta = 0; theta < (around ? 1 : taps_.size()); ++theta) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        const glm::dvec2 mm = first_mm_ + step_mm_ * glm::dvec2(x, y);
        const auto for_taps = [&](const auto& visit) {
          for (const Tap& tap : taps_[theta]) {
            const MovedPlace u(x, glm::dot(turn(tap).x, mm), nx, fraction_error_);
            const MovedPlace v(y, glm::dot(turn(tap).y, mm), ny, fraction_error_);
            if (!u.beyond(nx) && !v.beyond(ny)) {
              visit(tap, u, v);
            }
          }
        };
        double inside = 0.0;
        for_taps([&](const Tap& tap, const MovedPlace& u, const MovedPlace& v) {
          inside += tap.weight * u.inside(nx) * v.inside(ny);
        });
        for_taps([&](const Tap& tap, const MovedPlace& u, const MovedPlace& v) {
          double* const plane = turned.data() + (around ? 0 : std::ptrdiff_t{tap.theta} * ny * nx);
          for (const int j : {0, 1}) {
            for (const int i : {0, 1}) {
              if (u.bin + i >= 0 && u.bin + i < nx && v.bin + j >= 0 && v.bin + j < ny) {
                plane[(v.bin + j) * nx + u.bin + i] += tap.weight / inside *
                                                       (i == 0 ? 1.0 - u.fraction : u.fraction) *
                                                       (j == 0 ? 1.0 - v.fraction : v.fraction);
              }
            }
          }
        });
      }
    }
  }
  // What the blurs along x and along y spread is collected again.
  const auto collect = [&](const std::vector<double>& from, bool along_x) {
    const AxisBlur& axis = along_x ? x_ : y_;
    const int count = along_x ? nx : ny;
    const std::ptrdiff_t stride = along_x ? 1 : nx;
    std::vector<double> to(from.size());
    std::ptrdiff_t bin = 0;
    while (bin < static_cast<std::ptrdiff_t>(from.size())) {
      for (int y = 0; y < ny; ++y) {
        for (int x = 0; x < nx; ++x, ++bin) {
          const int at = along_x ? x : y;
          for (int k = std::max(-axis.steps, -at); k <= std::min(axis.steps, count - 1 - at); ++k) {
            to[bin] += axis.weight[std::abs(k)] * axis.scale[at + k] * from[bin + k * stride];
          }
        }
      }
    }
    return to;
  };
  return collect(collect(turned, true), false);
}

}  // namespace palpate
