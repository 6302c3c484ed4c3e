#include "estimation/bounded/moving/moving_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/log_sum.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = MovingObject::tile_bins;
/// Error of a bin, in nats, beyond which it counts as what may be missing.
constexpr double most_rounding = 1e-11;
/// What may be missing of a bin counts for a pose's fit where it is not so far below what is known.
constexpr double most_missing_nats = 3.0;

/// Takes an error of a bin's mass into what may be missing where it is large, and into the rounding
/// of all bins where it is small.
void take_error(double error, double& log_mass, double& log_rest, double& rounding) {
  if (error <= most_rounding) {
    rounding = std::max(rounding, error);
    return;
  }
  // The mass is wrong by e^error - 1 of itself.
  if (const double least = 2.0 - std::exp(error); least > 0.0) {
    log_rest = log_add(log_rest, log_mass + std::log(2.0 * std::expm1(error)));
    log_mass += std::log(least);
  } else {
    log_rest = log_add(log_rest, log_mass + error);
    log_mass = -infinity;
  }
}

}  // namespace

MovingObject::MovingObject(const SlipTask& task, std::size_t object, const glm::dvec2& centroid_mm)
    : task_(task),
      object_(object),
      of_bins_(task.weights, centroid_mm, 1),
      of_tiles_(task.weights, centroid_mm, side),
      columns_(of_tiles_.columns()),
      rows_(of_tiles_.rows()),
      kept_(of_bins_.kept()),
      least_kept_(*std::ranges::min_element(kept_)),
      most_kept_(*std::ranges::max_element(kept_)) {
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      const auto bins = static_cast<double>(box_of({0, y, x, 1}).bins());
      log_tile_bins_.push_back(std::log(bins));
    }
  }
  start();
}

void MovingObject::start() {
  const auto bins = static_cast<std::size_t>(task_.lattice.bins());
  log_mass_.assign(bins, 0.0);
  before_.assign(bins, 0.0);
  log_rest_.assign(bins, -infinity);
  const auto tiles = static_cast<std::size_t>(task_.lattice.theta_rad.count) * rows_ * columns_;
  follow(std::vector<std::uint8_t>(tiles, 1));
  rounding_ = scale_ = over_ = under_ = 0.0;
  // Nothing slips before the first touch: what slips keep is not asked for.
  const double log_bins = std::log(static_cast<double>(bins));
  sums_ = {.mass = log_bins, .rest = -infinity, .kept = log_bins, .off = -infinity};
}

void MovingObject::step(const KnownElements& touch, bool slips, const TileBeliefs& tiles,
                        std::vector<std::uint8_t> followed, bool by_logs) {
  // All of log_mass_ is written anew; before the first touch both are the uniform belief.
  before_.swap(log_mass_);
  follow(std::move(followed));
  if (slips) {
    restore();
    slip(by_logs);
  }
  if (!touch.runs.empty()) {
    multiply(touch);
  }
  leave_others(tiles);
  add_up(tiles);
}

void MovingObject::slip(bool by_logs) {
  std::vector<double>& log_mean = task_.log_mean;
  std::vector<double>& error = task_.error;
  if (sums_.rest > -infinity) {
    const double lost = of_bins_.means(runs_, log_rest_, log_mean, error, false);
    for_bins(runs_, [&](std::size_t bin) {
      log_rest_[bin] = log_mean[bin] == -infinity ? lost : log_mean[bin] + error[bin] + 1e-12;
    });
  }
  const double lost = of_bins_.means(runs_, before_, log_mean, error, by_logs);
  rounding_ += of_bins_.mean_error();
  change_bins([&](std::size_t bin, double& log_mass, double& rest, double& most) {
    log_mass = log_mean[bin];
    if (log_mass == -infinity) {
      rest = log_add(rest, lost);
    } else {
      take_error(error[bin], log_mass, rest, most);
    }
  });
}

/// The mass is that of the bins' true parts, which rounding changes by e^-rounding to e^rounding,
/// and of what is missing. These change the mean of what is kept by its spread alone.
void MovingObject::restore() {
  const double spread =
      std::exp(sums_.off - sums_.kept) + std::abs(std::expm1(sums_.mass - sums_.kept));
  const double parts = std::log1p(std::expm1(2.0 * rounding_) * spread);
  const bool known = std::isfinite(sums_.mass);
  // Logs of parts, since masses of many touches are beyond float64.
  const auto missing = [&](double log_part) {
    return known ? parts + std::log1p(std::exp(log_part + sums_.rest + rounding_)) : infinity;
  };
  const double ratio = known ? sums_.mass - sums_.kept : 0.0;
  const double most = missing(-sums_.mass);
  const double least = missing(std::log(most_kept_) - sums_.kept);
  const double error = of_bins_.kept_error() + 1e-12;
  scale_ += ratio;
  over_ += std::max(0.0, std::min(-std::log(least_kept_) - ratio, most)) + error;
  under_ += std::max(0.0, std::min(std::log(most_kept_) + ratio, least)) + error;
}

void MovingObject::evaluate(const KnownElements& touch, std::span<const BlockRun> runs) const {
  std::vector<BinBox> boxes;
  std::size_t bins = 0;
  for (const BlockRun& run : runs) {
    boxes.push_back(box_of(run));
    bins += static_cast<std::size_t>(boxes.back().bins());
  }
  std::vector<double> values(bins);
  std::vector<double> errors(bins);
  task_.likelihood.evaluate(boxes, touch, Arithmetic::float64, values, errors);
  std::size_t value = 0;
  for_bins(runs, [&](std::size_t bin) {
    task_.log_mean[bin] = values[value];
    task_.error[bin] = errors[value++];
  });
}

void MovingObject::multiply(const KnownElements& touch) {
  evaluate(touch, runs_);
  const double rounding = task_.likelihood.error(object_, touch, Arithmetic::float64);
  rounding_ += rounding;
  change_bins([&](std::size_t bin, double& log_mass, double& rest, double& most) {
    log_mass += task_.log_mean[bin];
    rest += task_.log_mean[bin] + task_.error[bin] + rounding;
    take_error(task_.error[bin], log_mass, rest, most);
  });
}

template <typename Set>
void MovingObject::change_bins(const Set& set) {
  std::vector<double> most(runs_.size());
  std::vector<double> largest(runs_.size());
  parallel_for(runs_.size(), [&](std::size_t i) {
    for_bins(std::span(runs_).subspan(i, 1), [&](std::size_t bin) {
      set(bin, log_mass_[bin], log_rest_[bin], most[i]);
      if (log_mass_[bin] > -infinity) {
        largest[i] = std::max(largest[i], std::abs(log_mass_[bin]));
      }
    });
  });
  // Logs round by a few units of the largest.
  if (!runs_.empty()) {
    rounding_ +=
        *std::ranges::max_element(most) + 0x1p-51 * (1.0 + *std::ranges::max_element(largest));
  }
}

void MovingObject::add_up(const TileBeliefs& tiles) {
  std::vector<Sums> of_run(runs_.size());
  parallel_for(runs_.size(), [&](std::size_t i) {
    const std::span<const BlockRun> run = std::span(runs_).subspan(i, 1);
    double largest = -infinity;
    double largest_rest = -infinity;
    for_bins(run, [&](std::size_t bin) {
      largest = std::max(largest, log_mass_[bin]);
      largest_rest = std::max(largest_rest, log_rest_[bin]);
    });
    Sums sums;
    for_bins(run, [&](std::size_t bin) {
      if (log_mass_[bin] > -infinity) {
        const double mass = std::exp(log_mass_[bin] - largest);
        const double kept = kept_[bin % kept_.size()];
        sums.mass += mass;
        sums.kept += kept * mass;
        sums.off += std::abs(kept - 1.0) * mass;
      }
      if (log_rest_[bin] > -infinity) {
        sums.rest += std::exp(log_rest_[bin] - largest_rest);
      }
    });
    of_run[i] = {largest + std::log(sums.mass), largest_rest + std::log(sums.rest),
                 largest + std::log(sums.kept), largest + std::log(sums.off)};
  });
  const auto sum = [&](double Sums::*part) {
    LogSum all;
    for (const Sums& of : of_run) {
      all.add(of.*part);
    }
    return all;
  };
  LogSum rest = sum(&Sums::rest);
  for (std::size_t i = 0; i < followed_.size(); ++i) {
    if (followed_[i] == 0) {
      rest.add(tiles.bound[i]);
    }
  }
  sums_ = {sum(&Sums::mass).log(), rest.log() + 1e-9, sum(&Sums::kept).log(),
           sum(&Sums::off).log()};
}

std::vector<double> MovingObject::belief_within(std::span<const BlockRun> runs,
                                                std::span<const KnownElements> touches) const {
  std::vector<double> belief(log_mass_.size(), -infinity);
  for_bins(runs, [&](std::size_t bin) { belief[bin] = 0.0; });
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (i > 0) {
      of_bins_.means(runs, belief, task_.log_mean, task_.error, true);
      for_bins(runs, [&](std::size_t bin) { belief[bin] = task_.log_mean[bin]; });
    }
    if (!touches[i].runs.empty()) {
      evaluate(touches[i], runs);
      for_bins(runs, [&](std::size_t bin) { belief[bin] += task_.log_mean[bin]; });
    }
  }
  return belief;
}

std::vector<double> MovingObject::log_belief(std::span<const BinBox> boxes,
                                             std::span<const KnownElements> touches) const {
  std::vector<std::uint8_t> tiles(followed_.size());
  bool unknown = false;  // what may be missing of some bin counts
  for (const BinBox& box : boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      const std::int64_t bin = box.bin(i, task_.lattice);
      const auto at = static_cast<std::size_t>(bin);
      tiles[tile_of(bin)] = 1;
      unknown |= log_rest_[at] > log_mass_[at] - most_missing_nats;
    }
  }
  const std::vector<double> within =
      unknown ? belief_within(runs_of(tiles), touches) : std::vector<double>();
  std::vector<double> logs;
  for (const BinBox& box : boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      const std::int64_t bin = box.bin(i, task_.lattice);
      const auto at = static_cast<std::size_t>(bin);
      const double least = unknown ? std::max(log_mass_[at], within[at]) : log_mass_[at];
      logs.push_back(least > -infinity ? std::min(most(bin), scale_ + least) : most(bin));
    }
  }
  return logs;
}

double MovingObject::most(std::int64_t bin) const {
  const auto at = static_cast<std::size_t>(bin);
  return scale_ + over_ + log_add(log_mass_[at] + rounding(), log_rest_[at]);
}

double MovingObject::rounding() const {
  // A sum rounds by a unit or two for each of its terms.
  const double terms =
      static_cast<double>(side * task_.lattice.x_mm.count) + static_cast<double>(runs_.size());
  return rounding_ + 4.0 * 0x1p-53 * terms;
}

BinBox MovingObject::box_of(const BlockRun& run) const {
  const PoseLattice& lattice = task_.lattice;
  return {.object = static_cast<std::int32_t>(object_),
          .theta = run.theta,
          .y_first = side * run.y,
          .y_count = std::min(side, lattice.y_mm.count - side * run.y),
          .x_first = side * run.x,
          .x_count = std::min(side * run.count, lattice.x_mm.count - side * run.x)};
}

}  // namespace palpate
