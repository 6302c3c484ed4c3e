#include "estimation/bounded/moving/moving_belief.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "estimation/contact_evidence.hpp"
#include "estimation/lattice/refinement.hpp"
#include "estimation/log_sum.hpp"

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
/// Nats below all of the belief at which a tile is not followed, at first; and from which on all
/// tiles are.
constexpr double first_depth = 40.0;
constexpr double last_depth = 160.0;
/// Tiles that are followed however little time is left, and the part of all: bounding all takes
/// longer than following so many.
constexpr std::size_t fewest_tiles = 256;
constexpr std::size_t of_all_tiles = 64;
/// Another run lets a touch follow so many times the tiles of the run before, which takes no longer
/// than so many times its time.
constexpr double again_more = 2.0;

double seconds_since(Deadline::Clock::time_point start) {
  return std::chrono::duration<double>(Deadline::Clock::now() - start).count();
}

}  // namespace

MovingBelief::MovingBelief(const SearchSpace& space, const BoundedOptions& options,
                           const BinLikelihood& likelihood, std::span<const Hypothesis> hypotheses)
    : space_(space),
      options_(options),
      weights_(options.lattice, options.slip_sd),
      log_mean_(static_cast<std::size_t>(options.lattice.bins())),
      error_(log_mean_.size()) {
  objects_.reserve(hypotheses.size());
  for (const Hypothesis& hypothesis : hypotheses) {
    objects_.emplace_back(SlipTask{space, options.lattice, likelihood, weights_, log_mean_, error_},
                          objects_.size(), displaced_body(hypothesis.map).centroid_mm);
  }
  reset();
}

double MovingBelief::bytes_needed(const BoundedOptions& options, std::size_t objects) {
  // Every object keeps what is followed, also before the last touch, what is missing and what all
  // bins keep; one at a time has means, errors, what will be missing, and planes: as they are,
  // blurred along y, blurred, and their neighbours' sums.
  const double of_object = options.lattice.full_circle() ? 3.0 : 4.0;
  const double numbers = of_object * static_cast<double>(objects) + 3.0 + 4.0;
  // What is believed of the tiles of all objects, and their ranks where there is a budget.
  constexpr double tile = MovingObject::tile_bins * MovingObject::tile_bins;
  const double of_tile = (options.budget_s ? 7.0 : 1.0) * static_cast<double>(objects) / tile;
  return (numbers + of_tile) * sizeof(double) * static_cast<double>(options.lattice.bins());
}

void MovingBelief::reset() {
  touches_.clear();
  depth_ = first_depth;
  followed_.clear();
  start();
}

void MovingBelief::start() {
  for (MovingObject& object : objects_) {
    object.start();
  }
  stepped_ = 0;
  cut_short_ = false;
  again_ = false;
  spent_s_ = 0.0;
  prior_log_likelihood_ = 0.0;
}

void MovingBelief::take_in(const Deadline& deadline) {
  try {
    while (stepped_ < touches_.size()) {
      step(touches_[stepped_], deadline);
    }
  } catch (...) {
    start();
    throw;
  }
}

void MovingBelief::step(const KnownElements& touch, const Deadline& deadline) {
  const bool slips = stepped_ > 0;
  const auto begin = Deadline::Clock::now();
  std::vector<TileBeliefs> tiles;
  for (const MovingObject& object : objects_) {
    deadline.cancel_point();
    tiles.push_back(object.tile_beliefs(touch, slips, deadline.exists()));
  }
  set_least(tiles);
  FollowedTiles followed = all_that_matter(tiles);
  if (deadline.exists()) {
    cut_short_ |= leave_best(most_followed(slips, deadline), tiles, depth_, followed);
  }
  std::size_t count = 0;
  for (const std::vector<std::uint8_t>& of_object : followed) {
    count += static_cast<std::size_t>(std::ranges::count(of_object, 1));
  }
  const auto bounded = Deadline::Clock::now();
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    deadline.cancel_point();
    objects_[i].step(touch, slips, tiles[i], std::move(followed[i]), depth_ == infinity);
  }
  if (deadline.exists()) {
    pace_.note(slips, count, seconds_since(bounded));
  }
  spent_s_ += seconds_since(begin);
  followed_.resize(std::max(followed_.size(), stepped_ + 1));
  followed_[stepped_] = count;
  prior_log_likelihood_ += prior_log_likelihood(touch, options_.contact);
  ++stepped_;
}

std::size_t MovingBelief::most_followed(bool slips, const Deadline& deadline) const {
  std::size_t all = 0;
  for (const MovingObject& object : objects_) {
    all += object.tiles();
  }
  const double within = std::min(pace_.tiles_within(slips, deadline.left_s()), 1e12);
  std::size_t most = std::max({fewest_tiles, all / of_all_tiles, static_cast<std::size_t>(within)});
  if (again_) {
    // No worse than what the last run found.
    most = std::max(
        most, static_cast<std::size_t>(again_more * static_cast<double>(followed_[stepped_])));
  }
  return most;
}

void MovingBelief::set_least(std::span<TileBeliefs> tiles) const {
  std::vector<double> scale;
  LogSum total;
  std::vector<LogSum> of_label(objects_.size());
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    tiles[i].scale += space_.log_weight[i];
    scale.push_back(tiles[i].scale + objects_[i].over());
    LogSum sum;
    for (const double bound : tiles[i].bound) {
      sum.add(bound);
    }
    of_label[space_.label_of[i]].add(scale[i] + sum.log());
    total.add(scale[i] + sum.log());
  }
  // Where every label's own total is wanted, none is negligible beside all.
  const double range = options_.evidence_range_nats *
                       (1.0 + options_.evidence_growth * static_cast<double>(stepped_));
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const double whole = options_.evidence_nats
                             ? std::max(of_label[space_.label_of[i]].log(), total.log() - range)
                             : total.log();
    tiles[i].least = whole - depth_ - scale[i];
  }
}

SearchResult MovingBelief::find(const SearchGoal& goal, const Deadline& deadline) {
  take_in(deadline);
  SearchResult found = result();
  while ((cut_short_ || depth_ < infinity) && again_more * spent_s_ < deadline.left_s() &&
         !reaches(found, goal)) {
    if (!cut_short_) {
      depth_ = depth_ < last_depth ? 2.0 * depth_ : infinity;
    }
    start();
    again_ = true;
    take_in(deadline);
    again_ = false;
    found = result();
  }
  return found;
}

void MovingBelief::visit(const BinVisitor& visit) const {
  std::vector<double> logs;
  for (const MovingObject& object : objects_) {
    if (object.mass() == -infinity) {
      continue;  // upper bounds alone
    }
    for (const BlockRun& run : object.runs()) {
      logs.clear();
      object.for_bins(std::span(&run, 1), [&](std::size_t bin) {
        logs.push_back(object.scale() + std::max(object.log_mass()[bin], no_mass));
      });
      visit(object.box_of(run), logs);
    }
  }
}

SearchResult MovingBelief::result() const {
  SearchResult found;
  // The scale of the heaviest object is a factor that all share, as far as it is not known.
  std::size_t heaviest = 0;
  const auto mass_of = [&](std::size_t i) {
    return space_.log_weight[i] + objects_[i].scale() + objects_[i].mass();
  };
  for (std::size_t i = 1; i < objects_.size(); ++i) {
    heaviest = mass_of(i) > mass_of(heaviest) ? i : heaviest;
  }
  const MovingObject& shared = objects_[heaviest];
  found.shared_nats = std::max(shared.over(), shared.under());
  double best = -infinity;
  double least_best = -infinity;       // as far as it is known
  double most_likelihood = -infinity;  // of any object, however unlikely it was before
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const MovingObject& object = objects_[i];
    const double scale = space_.log_weight[i] + object.scale();
    const double over = i == heaviest ? 0.0 : object.over() + shared.under();
    const double under = i == heaviest ? 0.0 : object.under() + shared.over();
    const double part =
        std::max(std::expm1(object.rounding() + over), -std::expm1(-object.rounding() - under));
    found.mass.push_back(
        {.evaluated = scale + object.mass(),
         .rounding = object.mass() > -infinity ? scale + object.mass() + std::log(part) : -infinity,
         .dropped = scale + over + object.rest()});
    object.for_bins(object.runs(), [&](std::size_t bin) {
      const double log = scale + object.log_mass()[bin];
      most_likelihood = std::max(most_likelihood, log - space_.log_weight[i]);
      if (log > best) {
        best = log;
        least_best = best - object.rounding() - under;
        found.best_object = static_cast<std::int32_t>(i);
        found.best_bin = static_cast<std::int64_t>(bin);
        found.best_log_likelihood = log - space_.log_weight[i];
      }
    });
    found.blocks_bounded += static_cast<std::int64_t>(object.tiles());
    for (const BlockRun& run : object.runs()) {
      found.bins_evaluated += object.box_of(run).bins();
    }
  }
  found.mode_certain = true;
  for (std::size_t i = 0; i < objects_.size() && found.mode_certain; ++i) {
    const MovingObject& object = objects_[i];
    const double most = space_.log_weight[i] + object.scale() +
                        (i == heaviest ? 0.0 : object.over() + shared.under());
    for (std::size_t bin = 0; bin < object.log_rest().size(); ++bin) {
      const double mass = object.log_mass()[bin] + object.rounding();
      const double rest = object.log_rest()[bin];
      const bool best_itself =
          std::cmp_equal(i, found.best_object) && std::cmp_equal(bin, found.best_bin);
      // A sum is at most twice the larger one.
      if (!best_itself && most + std::max(mass, rest) + std::numbers::ln2 >= least_best &&
          most + log_add(mass, rest) >= least_best) {
        found.mode_certain = false;
        break;
      }
    }
  }
  // Where no bin has mass, none was looked at.
  found.contradicted =
      most_likelihood > -infinity && prior_log_likelihood_ - most_likelihood > contradiction_nats;
  return found;
}

bool MovingBelief::reaches(const SearchResult& found, const SearchGoal& goal) const {
  // Rounding stays, however many bins are followed.
  double rounding = 0.0;
  for (const MovingObject& object : objects_) {
    rounding = std::max(rounding, object.rounding());
  }
  if (!(found.unproven() <= std::max(goal.tolerance, 2.0 * rounding))) {
    return false;
  }
  if (!goal.evidence_nats) {
    return true;
  }
  std::vector<LogSum> low(found.mass.size());
  std::vector<LogSum> high(found.mass.size());
  for (std::size_t i = 0; i < found.mass.size(); ++i) {
    const LogInterval bounds = found.mass[i].bounds();
    low[space_.label_of[i]].add(bounds.low);
    high[space_.label_of[i]].add(bounds.high);
  }
  const double least = found.all().evaluated - goal.evidence_range_nats;
  for (std::size_t i = 0; i < low.size(); ++i) {
    if (high[i].log() > least &&
        high[i].log() - low[i].log() + 2.0 * found.shared_nats > *goal.evidence_nats) {
      return false;
    }
  }
  return true;
}

std::vector<double> MovingBelief::log_likelihood(std::span<const BinBox> boxes) const {
  std::vector<double> logs;
  for (const BinBox& box : boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      logs.push_back(objects_[box.object].most(box.bin(i, options_.lattice)));
    }
  }
  return logs;
}

std::vector<double> MovingBelief::close_log_likelihood(std::span<const BinBox> boxes) const {
  const std::span<const KnownElements> touches = std::span(touches_).first(stepped_);
  std::vector<double> logs;
  for (std::size_t begin = 0; begin < boxes.size();) {
    std::size_t end = begin;
    while (end < boxes.size() && boxes[end].object == boxes[begin].object) {
      ++end;
    }
    const std::vector<double> of_object =
        objects_[boxes[begin].object].log_belief(boxes.subspan(begin, end - begin), touches);
    logs.insert(logs.end(), of_object.begin(), of_object.end());
    begin = end;
  }
  return logs;
}

}  // namespace palpate
