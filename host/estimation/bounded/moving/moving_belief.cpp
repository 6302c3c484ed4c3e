#include "estimation/bounded/moving/moving_belief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/bounded/displaced/displaced_tiles.hpp"
#include "estimation/bounded/log_sum.hpp"
#include "estimation/bounded/parallel_for.hpp"
#include "estimation/contact_evidence.hpp"
#include "estimation/lattice/refinement.hpp"

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = MovingBelief::tile_bins;
/// Nats below all of the belief at which a tile is not followed, at first; and from which on all
/// tiles are.
constexpr double first_depth = 40.0;
constexpr double last_depth = 200.0;
/// Error of a bin, in nats, beyond which it counts as what may be missing.
constexpr double most_rounding = 1e-11;

/// The log of no mass, as a number.
constexpr double no_mass = -1e9;

/// Takes an error of a bin's mass into what may be missing where it is large, and into the rounding
/// of all bins where it is small.
void settle(double error, double& log_mass, double& log_rest, double& rounding) {
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

MovingBelief::MovingBelief(const SearchSpace& space, const BoundedOptions& options,
                           const BinLikelihood& likelihood, std::span<const Hypothesis> hypotheses)
    : space_(space),
      options_(options),
      likelihood_(likelihood),
      weights_(options.lattice, options.slip_sd),
      moving_(hypotheses.size()) {
  for (const Hypothesis& hypothesis : hypotheses) {
    const glm::dvec2 centroid_mm = displaced_body(hypothesis.map).centroid_mm;
    of_bins_.emplace_back(weights_, centroid_mm, 1);
    of_tiles_.emplace_back(weights_, centroid_mm, side);
  }
  columns_ = of_tiles_.front().columns();
  rows_ = of_tiles_.front().rows();
  for (const SlipMean& mean : of_bins_) {
    Kept& kept = kept_.emplace_back(Kept{.part = mean.kept()});
    kept.least = *std::ranges::min_element(kept.part);
    kept.most = *std::ranges::max_element(kept.part);
  }
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      log_bins_.push_back(std::log(std::min(side, options.lattice.x_mm.count - side * x) *
                                   std::min(side, options.lattice.y_mm.count - side * y)));
    }
  }
  const auto bins = static_cast<std::size_t>(options.lattice.bins());
  log_mean_.resize(bins);
  log_rest_mean_.resize(bins);
  error_.resize(bins);
  reset();
}

double MovingBelief::bytes_needed(const PoseLattice& lattice, std::size_t objects) {
  // Mass and rest of every object's bins; means of one object's, and its planes: as they are,
  // blurred along y, blurred, and their neighbours' sums. With the parts that all bins keep.
  const double numbers = 3.0 * static_cast<double>(objects) + 3.0 + 4.0;
  return numbers * sizeof(double) * static_cast<double>(lattice.bins());
}

template <typename Visit>
void MovingBelief::for_bins(std::span<const BlockRun> runs, const Visit& visit) const {
  const PoseLattice& lattice = options_.lattice;
  for (const BlockRun& run : runs) {
    const int end = std::min(side * (run.x + run.count), lattice.x_mm.count);
    for (int y = side * run.y; y < std::min(side * (run.y + 1), lattice.y_mm.count); ++y) {
      const std::size_t row = (static_cast<std::size_t>(run.theta) * lattice.y_mm.count + y) *
                              static_cast<std::size_t>(lattice.x_mm.count);
      for (int x = side * run.x; x < end; ++x) {
        visit(row + static_cast<std::size_t>(x));
      }
    }
  }
}

void MovingBelief::reset() {
  touches_.clear();
  depth_ = first_depth;
  start();
}

void MovingBelief::start() {
  const auto bins = static_cast<std::size_t>(options_.lattice.bins());
  const auto tiles = static_cast<std::size_t>(options_.lattice.theta_rad.count) * rows_ * columns_;
  for (Moving& moving : moving_) {
    moving.log_mass.assign(bins, 0.0);
    moving.log_rest.assign(bins, -infinity);
    moving.followed.assign(tiles, 1);
    moving.bins_followed = static_cast<std::int64_t>(bins);
    moving.sums = {};
    moving.rounding = moving.scale = moving.over = moving.under = 0.0;
  }
  stepped_ = 0;
  prior_log_likelihood_ = 0.0;
}

void MovingBelief::take_in(const Deadline& deadline) {
  try {
    while (stepped_ < touches_.size()) {
      deadline.cancel_point();
      step(touches_[stepped_]);
    }
  } catch (...) {
    start();
    throw;
  }
}

void MovingBelief::step(const KnownElements& touch) {
  std::vector<TileMasses> tiles;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    tiles.push_back(bound_tiles(i, touch));
  }
  choose(tiles);
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    Moving& moving = moving_[i];
    const std::vector<BlockRun> runs = runs_of(moving);
    if (stepped_ > 0) {
      slip(i, runs);
      restore(i);
    }
    if (!touch.runs.empty()) {
      touch_bins(i, touch, runs);
    }
    leave_others(moving, tiles[i].touched);
    moving.sums = add_up(i, runs, tiles[i].touched);
  }
  prior_log_likelihood_ += prior_log_likelihood(touch, options_.contact);
  ++stepped_;
}

MovingBelief::TileMasses MovingBelief::bound_tiles(std::size_t object,
                                                   const KnownElements& touch) const {
  TileMasses tiles;
  tiles.slipped = largest_of_tiles(moving_[object]);
  if (stepped_ > 0) {
    tiles.slipped = of_tiles_[object].bounds(tiles.slipped);
  }
  tiles.touched = tiles.slipped;
  if (!touch.runs.empty()) {
    add_touch_bounds(object, touch, tiles.touched);
  }
  return tiles;
}

std::vector<double> MovingBelief::largest_of_tiles(const Moving& moving) const {
  const PoseLattice& lattice = options_.lattice;
  std::vector<double> largest(moving.followed.size());
  parallel_for(static_cast<std::size_t>(lattice.theta_rad.count), [&](std::size_t theta) {
    std::vector<double> mass(columns_);
    std::vector<double> rest(columns_);
    for (int row = 0; row < rows_; ++row) {
      std::ranges::fill(mass, -infinity);
      std::ranges::fill(rest, -infinity);
      for (int y = side * row; y < std::min(side * (row + 1), lattice.y_mm.count); ++y) {
        const std::size_t bin =
            (theta * lattice.y_mm.count + y) * static_cast<std::size_t>(lattice.x_mm.count);
        for (int x = 0; x < lattice.x_mm.count; ++x) {
          mass[x / side] = std::max(mass[x / side], moving.log_mass[bin + x]);
          rest[x / side] = std::max(rest[x / side], moving.log_rest[bin + x]);
        }
      }
      for (int x = 0; x < columns_; ++x) {
        largest[(theta * rows_ + row) * columns_ + x] =
            log_add(mass[x] + moving.rounding, rest[x]) + 1e-12;
      }
    }
  });
  return largest;
}

void MovingBelief::add_touch_bounds(std::size_t object, const KnownElements& touch,
                                    std::vector<double>& logs) const {
  const TileBounds& bounds = space_.bounds[object];
  const TileLevel& tiling = bounds.levels().front();
  const double best = bounds.best(0, touch);
  const auto thetas = static_cast<std::size_t>(options_.lattice.theta_rad.count);
  std::vector<BlockRun> batches;
  for (std::size_t theta = 0; theta < thetas; ++theta) {
    for (int y = 0; y < tiling.batches_y(); ++y) {
      batches.push_back({static_cast<int>(theta), y, 0, tiling.batches_x()});
    }
  }
  const auto of_theta = static_cast<std::size_t>(tiling.batches_y());
  std::vector<std::int32_t> displaced;
  PlaceSource<float> exact;
  if (touch.touches.empty()) {
    exact = exact_penalties(space_, object, 0, touch);
  } else {
    displaced = displaced_penalties(space_, object, 0, touch.touches.front(), batches);
  }
  parallel_for(thetas, [&](std::size_t theta) {
    const int width = tiling.x.tiles();
    std::vector<float> nats(static_cast<std::size_t>(width) * tiling.y.tiles());
    if (touch.touches.empty()) {
      exact(std::span(batches).subspan(theta * of_theta, of_theta), {nats.data(), width, 0, 0});
    } else {
      const std::int32_t* penalty = displaced.data() + theta * nats.size();
      for (int y = 0; y < tiling.y.tiles(); y += side) {
        for (int x = 0; x < width; x += side) {
          for (int i = 0; i < side; ++i) {
            for (int j = 0; j < side; ++j) {
              nats[static_cast<std::size_t>((y + j) * width + x + i)] =
                  static_cast<float>(*penalty++ * (-1.0 / penalties_per_nat) + 1e-3);
            }
          }
        }
      }
    }
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        logs[(theta * rows_ + y) * columns_ + x] +=
            best + nats[static_cast<std::size_t>(y) * width + x];
      }
    }
  });
}

void MovingBelief::choose(std::span<const TileMasses> tiles) {
  const auto scaled = [&](std::size_t object) {
    return space_.log_weight[object] + moving_[object].scale + moving_[object].over;
  };
  const auto for_tiles = [&](std::size_t object, const auto& visit) {
    for (std::size_t i = 0; i < tiles[object].touched.size(); ++i) {
      visit(i, scaled(object) + tiles[object].touched[i] + log_bins_[i % log_bins_.size()]);
    }
  };
  LogSum total;
  std::vector<LogSum> of_label(moving_.size());
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    for_tiles(i, [&](std::size_t, double mass) { of_label[space_.label_of[i]].add(mass); });
  }
  for (const LogSum& of : of_label) {
    total.add(of.log());
  }
  const double range = options_.evidence_range_nats *
                       (1.0 + options_.evidence_growth * static_cast<double>(stepped_));
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    double whole = total.log();
    if (options_.evidence_nats) {
      whole = std::max(of_label[space_.label_of[i]].log(), whole - range);
    }
    Moving& moving = moving_[i];
    moving.bins_followed = 0;
    for_tiles(i, [&](std::size_t tile, double mass) {
      // What is no number is followed.
      const bool follow = !(mass < whole - depth_);
      moving.followed[tile] = follow ? 1 : 0;
      moving.bins_followed +=
          follow ? std::lround(std::exp(log_bins_[tile % log_bins_.size()])) : 0;
    });
  }
}

void MovingBelief::slip(std::size_t object, std::span<const BlockRun> runs) {
  Moving& moving = moving_[object];
  const SlipMean& mean = of_bins_[object];
  double lost_rest = -infinity;
  const bool has_rest = moving.sums.rest > -infinity;
  if (has_rest) {
    lost_rest = mean.means(runs, moving.log_rest, log_rest_mean_, error_, false);
    for_bins(runs, [&](std::size_t bin) {
      log_rest_mean_[bin] =
          log_rest_mean_[bin] == -infinity ? lost_rest : log_rest_mean_[bin] + error_[bin] + 1e-12;
    });
  }
  const double lost = mean.means(runs, moving.log_mass, log_mean_, error_, depth_ == infinity);
  moving.rounding += mean.mean_error();
  settle_bins(moving, runs, [&](std::size_t bin, double& log_mass, double& log_rest, double& most) {
    log_mass = log_mean_[bin];
    log_rest = has_rest ? log_rest_mean_[bin] : -infinity;
    if (log_mass == -infinity) {
      log_rest = log_add(log_rest, lost);
    } else {
      settle(error_[bin], log_mass, log_rest, most);
    }
  });
}

void MovingBelief::restore(std::size_t object) {
  Moving& moving = moving_[object];
  const Sums& sums = moving.sums;
  const Kept& kept = kept_[object];
  // The mass is that of the bins' true parts r, e^-rounding <= r <= e^rounding, and of what is
  // missing. These parts change the mean of what is kept by its spread alone.
  const double spread =
      std::exp(sums.off - sums.kept) + std::abs(std::expm1(sums.mass - sums.kept));
  const double parts = std::log1p(std::expm1(2.0 * moving.rounding) * spread);
  const bool known = std::isfinite(sums.mass);
  const double ratio = known ? sums.mass - sums.kept : 0.0;
  const double most =
      known ? parts + std::log1p(std::exp(sums.rest - sums.mass + moving.rounding)) : infinity;
  const double least =
      known ? parts + std::log1p(kept.most * std::exp(sums.rest - sums.kept + moving.rounding))
            : infinity;
  const double error = of_bins_[object].kept_error() + 1e-12;
  moving.scale += ratio;
  moving.over += std::max(0.0, std::min(most, -std::log(kept.least) - ratio)) + error;
  moving.under += std::max(0.0, std::min(least, std::log(kept.most) + ratio)) + error;
}

void MovingBelief::touch_bins(std::size_t object, const KnownElements& touch,
                              std::span<const BlockRun> runs) {
  Moving& moving = moving_[object];
  std::vector<BinBox> boxes;
  std::size_t bins = 0;
  for (const BlockRun& run : runs) {
    boxes.push_back(box_of(object, run));
    bins += static_cast<std::size_t>(boxes.back().bins());
  }
  std::vector<double> values(bins);
  std::vector<double> errors(likelihood_.displaces() ? bins : 0);
  likelihood_.evaluate(boxes, touch, Arithmetic::float64, values, errors);
  std::size_t value = 0;
  for (const BinBox& box : boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i, ++value) {
      const auto bin = static_cast<std::size_t>(box.bin(i, options_.lattice));
      log_mean_[bin] = values[value];
      error_[bin] = errors.empty() ? 0.0 : errors[value];
    }
  }
  const double rounding = likelihood_.error(object, touch, Arithmetic::float64);
  moving.rounding += rounding;
  settle_bins(moving, runs, [&](std::size_t bin, double& log_mass, double& log_rest, double& most) {
    log_mass += log_mean_[bin];
    log_rest += log_mean_[bin] + error_[bin] + rounding;
    settle(error_[bin], log_mass, log_rest, most);
  });
}

void MovingBelief::settle_bins(
    Moving& moving, std::span<const BlockRun> runs,
    const std::function<void(std::size_t, double&, double&, double&)>& set) {
  std::vector<double> most(runs.size());
  std::vector<double> largest(runs.size());
  parallel_for(runs.size(), [&](std::size_t i) {
    for_bins(runs.subspan(i, 1), [&](std::size_t bin) {
      set(bin, moving.log_mass[bin], moving.log_rest[bin], most[i]);
      if (std::isfinite(moving.log_mass[bin])) {
        largest[i] = std::max(largest[i], std::abs(moving.log_mass[bin]));
      }
    });
  });
  // Logs round by a few units of the largest.
  if (!runs.empty()) {
    moving.rounding +=
        *std::ranges::max_element(most) + 0x1p-51 * (1.0 + *std::ranges::max_element(largest));
  }
}

void MovingBelief::leave_others(Moving& moving, std::span<const double> tiles) const {
  const PoseLattice& lattice = options_.lattice;
  parallel_for(static_cast<std::size_t>(lattice.theta_rad.count), [&](std::size_t theta) {
    for (int y = 0; y < lattice.y_mm.count; ++y) {
      const std::size_t row =
          (theta * lattice.y_mm.count + y) * static_cast<std::size_t>(lattice.x_mm.count);
      const std::size_t first = (theta * rows_ + y / side) * columns_;
      for (int x = 0; x < lattice.x_mm.count; ++x) {
        if (const std::size_t tile = first + x / side; moving.followed[tile] == 0) {
          moving.log_mass[row + x] = -infinity;
          moving.log_rest[row + x] = tiles[tile];
        }
      }
    }
  });
}

MovingBelief::Sums MovingBelief::add_up(std::size_t object, std::span<const BlockRun> runs,
                                        std::span<const double> tiles) const {
  const Moving& moving = moving_[object];
  const std::vector<double>& part = kept_[object].part;
  std::vector<Sums> of_run(runs.size());
  parallel_for(runs.size(), [&](std::size_t i) {
    const std::span<const BlockRun> run = runs.subspan(i, 1);
    double largest = -infinity;
    double largest_rest = -infinity;
    for_bins(run, [&](std::size_t bin) {
      largest = std::max(largest, moving.log_mass[bin]);
      largest_rest = std::max(largest_rest, moving.log_rest[bin]);
    });
    Sums sums;
    for_bins(run, [&](std::size_t bin) {
      if (const double log = moving.log_mass[bin]; log > -infinity) {
        const double mass = std::exp(log - largest);
        const double kept = part[bin % part.size()];
        sums.mass += mass;
        sums.kept += kept * mass;
        sums.off += std::abs(kept - 1.0) * mass;
      }
      if (const double log = moving.log_rest[bin]; log > -infinity) {
        sums.rest += std::exp(log - largest_rest);
      }
    });
    of_run[i] = {largest + std::log(sums.mass), largest_rest + std::log(sums.rest),
                 largest + std::log(sums.kept), largest + std::log(sums.off)};
  });
  LogSum mass;
  LogSum rest;
  LogSum kept;
  LogSum off;
  for (const Sums& of : of_run) {
    mass.add(of.mass);
    rest.add(of.rest);
    kept.add(of.kept);
    off.add(of.off);
  }
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    if (moving.followed[i] == 0) {
      rest.add(tiles[i] + log_bins_[i % log_bins_.size()]);
    }
  }
  return {mass.log(), rest.log() + 1e-9, kept.log(), off.log()};
}

double MovingBelief::sum_error(std::span<const BlockRun> runs) const {
  const auto terms =
      static_cast<double>(side * options_.lattice.x_mm.count) + static_cast<double>(runs.size());
  return 4.0 * 0x1p-53 * terms;
}

SearchResult MovingBelief::find(const SearchGoal& goal, const Deadline& deadline,
                                const BinVisitor& visit) {
  take_in(deadline);
  SearchResult found = result();
  while (depth_ < infinity && !reaches(found, goal)) {
    depth_ = depth_ < last_depth ? 2.0 * depth_ : infinity;
    start();
    take_in(deadline);
    found = result();
  }
  std::vector<double> logs;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    for (const BlockRun& run : runs_of(moving_[i])) {
      logs.clear();
      for_bins(std::span(&run, 1), [&](std::size_t bin) {
        logs.push_back(moving_[i].scale + std::max(moving_[i].log_mass[bin], no_mass));
      });
      visit(box_of(i, run), logs);
    }
  }
  return found;
}

SearchResult MovingBelief::result() const {
  SearchResult found;
  double best = -infinity;
  double best_missing = -infinity;
  // The scale of the heaviest object is a factor that all share, as far as it is not known.
  std::size_t heaviest = 0;
  const auto mass_of = [&](std::size_t i) {
    return space_.log_weight[i] + moving_[i].scale + moving_[i].sums.mass;
  };
  for (std::size_t i = 1; i < moving_.size(); ++i) {
    heaviest = mass_of(i) > mass_of(heaviest) ? i : heaviest;
  }
  found.shared_nats = std::max(moving_[heaviest].over, moving_[heaviest].under);
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const Moving& moving = moving_[i];
    const double scale = space_.log_weight[i] + moving.scale;
    const std::vector<BlockRun> runs = runs_of(moving);
    const double over = i == heaviest ? 0.0 : moving.over + moving_[heaviest].under;
    const double under = i == heaviest ? 0.0 : moving.under + moving_[heaviest].over;
    const double most = moving.rounding + over + sum_error(runs);
    const double least = moving.rounding + under + sum_error(runs);
    found.mass.push_back({.evaluated = scale + moving.sums.mass,
                          .rounding = scale + moving.sums.mass +
                                      std::log(std::max(std::expm1(most), -std::expm1(-least))),
                          .dropped = scale + over + moving.sums.rest});
    best_missing =
        std::max(best_missing, scale + over + *std::ranges::max_element(moving.log_rest));
    for_bins(runs, [&](std::size_t bin) {
      if (scale + moving.log_mass[bin] > best) {
        best = scale + moving.log_mass[bin];
        found.best_object = static_cast<std::int32_t>(i);
        found.best_bin = static_cast<std::int64_t>(bin);
        found.best_log_likelihood = moving.scale + moving.log_mass[bin];
      }
    });
    found.blocks_bounded += static_cast<std::int64_t>(moving.followed.size());
    found.bins_evaluated += moving.bins_followed;
  }
  found.mode_certain = best_missing < best;
  found.contradicted = prior_log_likelihood_ - found.best_log_likelihood > contradiction_nats;
  return found;
}

bool MovingBelief::reaches(const SearchResult& found, const SearchGoal& goal) const {
  // Rounding stays, however many bins are followed.
  const double rounding = std::ranges::max_element(moving_, {}, &Moving::rounding)->rounding;
  if (!(found.uncertain() <= std::max(goal.tolerance, 2.0 * rounding))) {
    return false;
  }
  if (!goal.evidence_nats) {
    return true;
  }
  std::vector<std::pair<LogSum, LogSum>> of_label(found.mass.size());
  for (std::size_t i = 0; i < found.mass.size(); ++i) {
    const LogInterval bounds = found.mass[i].bounds();
    of_label[space_.label_of[i]].first.add(bounds.low);
    of_label[space_.label_of[i]].second.add(bounds.high);
  }
  const double least = found.all().evaluated - goal.evidence_range_nats;
  return std::ranges::all_of(of_label, [&](const auto& bounds) {
    const double high = bounds.second.log();
    return !(high > least) || high - bounds.first.log() <= *goal.evidence_nats;
  });
}

std::vector<double> MovingBelief::log_likelihood(std::span<const BinBox> boxes) const {
  std::vector<double> logs;
  for (const BinBox& box : boxes) {
    const Moving& moving = moving_[box.object];
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      const auto bin = static_cast<std::size_t>(box.bin(i, options_.lattice));
      logs.push_back(moving.scale + moving.over +
                     log_add(moving.log_mass[bin] + moving.rounding, moving.log_rest[bin]));
    }
  }
  return logs;
}

std::uint64_t MovingBelief::bytes() const {
  return static_cast<std::uint64_t>(bytes_needed(options_.lattice, moving_.size()));
}

std::vector<BlockRun> MovingBelief::runs_of(const Moving& moving) const {
  std::vector<BlockRun> runs;
  std::size_t tile = 0;
  for (int theta = 0; theta < options_.lattice.theta_rad.count; ++theta) {
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x, ++tile) {
        if (moving.followed[tile] != 0) {
          append_block(theta, y, x, runs);
        }
      }
    }
  }
  return runs;
}

BinBox MovingBelief::box_of(std::size_t object, const BlockRun& run) const {
  const PoseLattice& lattice = options_.lattice;
  return {.object = static_cast<std::int32_t>(object),
          .theta = run.theta,
          .y_first = side * run.y,
          .y_count = std::min(side, lattice.y_mm.count - side * run.y),
          .x_first = side * run.x,
          .x_count = std::min(side * run.count, lattice.x_mm.count - side * run.x)};
}

}  // namespace palpate
