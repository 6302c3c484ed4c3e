#include "estimation/bounded/bounded_belief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <tbb/info.h>

#include "estimation/bounded/belief_draws.hpp"
#include "estimation/bounded/log_sum.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/pose_draws.hpp"
#include "model/random.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

namespace {

/// After no more touches a belief is wide: a few draws need few of its bins.
constexpr std::size_t wide_touches = 2;
/// Bins of all hypotheses together up to which narrower beliefs are searched for draws.
constexpr double most_searched_bins = 1e8;
/// Bins of all hypotheses together up to which such a search has the full tolerance.
constexpr double closely_drawn_bins = 1e6;
/// Tolerance that a search with a budget reaches before it goes on, and enough for draws.
constexpr double soon = 1e-2;
/// Tolerance of a search for draws where touches are uncertain: it takes little longer than a rough
/// one, and leaves so little out that its bins can be followed through the next touches. Two of
/// them raise that share up to a hundred times.
constexpr double followable = 1e-4;
/// How closely the log odds of "none of these" are known, in nats, unless this or the tolerance is
/// more than it, or the hypotheses, may have.
constexpr double none_nats = 0.05;
constexpr double negligible = 1e-4;
constexpr double unlimited = std::numeric_limits<double>::infinity();

}  // namespace

BoundedBelief::BoundedBelief(std::span<const Hypothesis> hypotheses, const BoundedOptions& options)
    : options_(options),
      hypotheses_(hypotheses.begin(), hypotheses.end()),
      // More threads than cores gain nothing.
      threads_(options.threads > 0 ? std::min(options.threads, tbb::info::default_concurrency())
                                   : tbb::info::default_concurrency()),
      arena_(threads_),
      likelihood_(hypotheses_, options_.contact, options_.lattice, options_.touch_sd),
      space_(arena_.execute([&] { return SearchSpace(hypotheses_, options_); })),
      touches_(!options_.touch_sd.none()),
      search_(space_, options_, likelihood_) {
  if (!options_.slip_sd.none()) {
    moving_.emplace(space_, options_, likelihood_, hypotheses_);
  }
  if (options_.none_weight) {
    none_.emplace(space_, options_, likelihood_);
    none_log_weight_ = none_log_weight(*options_.none_weight, hypotheses_, options_.lattice);
  }
}

void BoundedBelief::reset() {
  change_.forget();
  touches_.clear();
  taken_in_ = 0;
  elements_ = {};
  search_.largest().reset();
  if (moving_) {
    moving_->reset();
  }
  found_.reset();
  followed_.reset();
  if (none_) {
    none_->reset();
  }
}

void BoundedBelief::move_pivot(const glm::dvec2& pivot_mm) {
  options_.lattice = with_pivot(options_.lattice, pivot_mm, "bounded posterior", taken_in_ > 0);
  likelihood_.move_pivot(pivot_mm);
  found_.reset();
  followed_.reset();
}

void BoundedBelief::add(std::span<const Touch> touches) {
  change_.refuse();
  touches_.add(touches, options_.contact, options_.lattice.pivot_mm);
}

void BoundedBelief::take_in() {
  change_.refuse();
  if (taken_in_ == touches_.size()) {
    return;
  }
  change_.change([&] {
    if (!moving_ && found_ && found_->bins.complete() &&
        found_->bins.values().size() <= FollowedBins::most_bins(likelihood_)) {
      followed_.emplace(found_->bins, found_->result, space_.log_weight, taken_in_);
    }
    found_.reset();
    const std::span<const ArrayReadings> added = touches_.all().subspan(taken_in_);
    std::vector<KnownElements> known;
    for (const ArrayReadings& touch : added) {
      known.push_back(known_elements(touch));
      for (KnownElements& uncertain : known.back().touches) {
        uncertain.exact_bins = std::make_shared<ExactBins>(hypotheses_.size(), space_.turns.size(),
                                                           ExactBins::most_bytes / touches_.size());
      }
    }
    if (moving_) {
      std::ranges::for_each(known, [&](const KnownElements& touch) { moving_->add(touch); });
    }
    if (!moving_) {
      arena_.execute([&] { search_.largest().add(known); });
    }
    known.insert(known.begin(), std::move(elements_));
    elements_ = merged(known);
    if (none_) {
      none_->add(added);
    }
    taken_in_ = touches_.size();
  });
}

std::string BoundedBelief::path() const {
  return fmt::format("{} on {} thread{}", likelihood_.instructions(), threads_,
                     threads_ == 1 ? "" : "s");
}

std::uint64_t BoundedBelief::bytes() const {
  std::uint64_t exact_bins = 0;
  for (const KnownElements& touch : elements_.touches) {
    exact_bins += touch.exact_bins->bytes();
  }
  return exact_bins + likelihood_.bytes() + space_.bytes() + search_.largest().bytes() +
         static_cast<std::uint64_t>(
             moving_ ? MovingBelief::bytes_needed(options_.lattice, hypotheses_.size()) : 0.0) +
         (found_ ? found_->bins.bytes() : 0);
}

SearchGoal BoundedBelief::goal() const {
  SearchGoal goal{options_.tolerance, options_.evidence_nats, options_.evidence_range_nats};
  goal.poor_bins = options_.poor_bins;
  if (taken_in_ == 1) {
    goal.evidence_range_nats = std::max(goal.evidence_range_nats, options_.single_touch_range_nats);
  }
  if (goal.evidence_nats && taken_in_ > 1) {
    const double grown = 1.0 + options_.evidence_growth * static_cast<double>(taken_in_ - 1);
    *goal.evidence_nats *= grown;
    goal.evidence_range_nats *= grown;
  }
  return goal;
}

double BoundedBelief::bins_in_all() const {
  return static_cast<double>(options_.lattice.bins()) * static_cast<double>(hypotheses_.size());
}

SearchGoal BoundedBelief::rough_goal() const {
  // Few bins take as long whatever the tolerance, and a close search lets those that are found be
  // followed through the next touches.
  const double rough = likelihood_.displaces() && !moving_ ? followable : soon;
  return {.tolerance = bins_in_all() <= closely_drawn_bins ? options_.tolerance
                                                           : std::max(options_.tolerance, rough),
          .exact = false,
          .poor_bins = options_.poor_bins};
}

const SearchResult& BoundedBelief::found() {
  const Deadline deadline = until(options_.budget_s);
  if (!found_ || !found_->goal.exact) {
    found_.reset();
    found_ = search();
  }
  if (none_ && !found_->none) {
    found_->none = bound_none(deadline);
  }
  return found_->result;
}

BoundedBelief::Found BoundedBelief::search() {
  // "None of these" has the rest of a budget, which is half of it at least.
  std::optional<double> budget_s = options_.budget_s;
  if (none_ && budget_s) {
    *budget_s /= 2.0;
  }
  Deadline deadline = until(budget_s);
  SearchGoal first = goal();
  if (deadline.exists()) {
    // What is proven soon comes first: a search that is cut short proves little.
    first.tolerance = std::max(first.tolerance, soon);
  }
  Found best = run(first, deadline);
  if (first.tolerance > options_.tolerance && !deadline.passed()) {
    Found better = run(goal(), deadline);
    if (better.result.uncertain() < best.result.uncertain()) {
      best = std::move(better);
    }
  }
  return best;
}

BoundedBelief::Found BoundedBelief::run(const SearchGoal& goal, Deadline& deadline) {
  EvaluatedBins bins(deadline.exists());
  SearchResult result =
      run(goal, deadline, [&](const BinBox& box, std::span<const double> log_likelihood) {
        bins.add(box, log_likelihood);
        if (bins.full()) {
          // With a budget, bins are evaluated as long as there is room for them: another search
          // could not evaluate the same.
          deadline.end();
        }
      });
  return {std::move(result), std::move(bins), goal};
}

SearchResult BoundedBelief::run(const SearchGoal& goal, const Deadline& deadline,
                                const BinVisitor& visitor, std::vector<PoseBlock>* refined) {
  return arena_.execute([&] {
    return moving_ ? moving_->find(goal, deadline, visitor)
                   : search_.run(elements_, goal, deadline, visitor, refined);
  });
}

std::vector<double> BoundedBelief::log_likelihood(std::span<const BinBox> boxes,
                                                  Arithmetic arithmetic) {
  if (moving_) {
    arena_.execute([&] { moving_->take_in(until({})); });
    return moving_->log_likelihood(boxes);
  }
  std::size_t bins = 0;
  for (const BinBox& box : boxes) {
    bins += static_cast<std::size_t>(box.bins());
  }
  std::vector<double> logs(bins);
  arena_.execute([&] { likelihood_.evaluate(boxes, elements_, arithmetic, logs); });
  return logs;
}

void BoundedBelief::visit(const BinVisitor& visitor) {
  if (found_->bins.complete()) {
    found_->bins.visit(visitor);
  } else {
    run(found_->goal, until({}), visitor);
  }
}

bool BoundedBelief::follow() {
  if (!followed_) {
    return false;
  }
  while (followed_->touches() < taken_in_) {
    const std::size_t next = followed_->touches();
    KnownElements touch = known_elements(touches_.all()[next]);
    std::vector<double> most;
    for (const TileBounds& bounds : space_.bounds) {
      most.push_back(bounds.best(space_.finest_level(), touch));
    }
    if (!touch.touches.empty()) {
      // Of uncertain touches, those with known elements are counted.
      const auto uncertain =
          static_cast<std::size_t>(std::ranges::count_if(touches_.all().first(next), any_known));
      touch.touches.front() = elements_.touches[uncertain];
      for (std::size_t i = 0; i < most.size(); ++i) {
        most[i] = std::min(most[i], search_.largest().most(uncertain, i));
      }
    }
    arena_.execute([&] { followed_->add(touch, likelihood_, most); });
  }
  if (!(followed_->share_outside() <= soon)) {
    followed_.reset();
  }
  return followed_.has_value();
}

std::vector<DrawnBin> BoundedBelief::draw(std::size_t count, Random& random) {
  const bool followed = !found_ && follow();
  if (moving_ && !found_) {
    Deadline never = until({});
    found_ = run(rough_goal(), never);
  } else if (!moving_ && !followed && !(found_ && found_->bins.complete())) {
    Deadline deadline = until(options_.budget_s);
    // Rejection looks at tiles here and there, which share little of what uncertain touches reach.
    const bool many_bins = bins_in_all() > most_searched_bins && options_.touch_sd.none();
    // Where a search had no room for its bins, another one would take as long.
    if (found_ || taken_in_ <= wide_touches || many_bins) {
      return arena_.execute([&] { return search_.draw(elements_, count, random, deadline); });
    }
    found_ = run(rough_goal(), deadline);
  }
  BeliefDraws draws(one_in_each_part(count, random), options_.lattice, space_.log_weight,
                    followed ? followed_->log_total() : log_total());
  const auto add = [&](const BinBox& box, std::span<const double> log_likelihood) {
    draws.add(box, log_likelihood);
  };
  if (followed) {
    followed_->visit(add);
  } else {
    visit(add);
  }
  return draws.take();
}

std::vector<PoseSample> BoundedBelief::sample(std::size_t count, std::uint64_t seed) {
  Random random(seed, Stream::belief);
  std::vector<PoseSample> samples;
  samples.reserve(count);
  for (const DrawnBin& drawn : draw(count, random)) {
    samples.push_back({drawn.object, draw_within(drawn.bin, options_.lattice, random)});
  }
  return samples;
}

std::vector<PoseBlock> BoundedBelief::refined_blocks() {
  const std::size_t finest = space_.finest_level();
  std::vector<PoseBlock> blocks;
  std::vector<PoseBlock> evaluated;
  const auto note = [&](const BinBox& box, std::span<const double> log_likelihoods) {
    if (static_cast<std::int64_t>(log_likelihoods.size()) == box.bins()) {
      evaluated.push_back(block_of(box, finest));
    }
  };
  run(goal(), until({}), note, &blocks);
  blocks.insert(blocks.end(), evaluated.begin(), evaluated.end());
  return blocks;
}

bool BoundedBelief::tells_enough(const LogInterval& none) const {
  const SearchGoal asked = goal();
  const double range = asked.evidence_nats ? asked.evidence_range_nats
                                           : -std::log(std::max(asked.tolerance, negligible));
  return none.high - none.low <= asked.evidence_nats.value_or(none_nats) ||
         none.high < log_total() - range || none.low > log_total() + range;
}

LogInterval BoundedBelief::bound_none(const Deadline& deadline) {
  const auto weighted = [&](const LogInterval& bounds) {
    return LogInterval{none_log_weight_ + bounds.low, none_log_weight_ + bounds.high};
  };
  return arena_.execute([&] {
    return weighted(none_->bounds(
        [&](const LogInterval& bounds) { return tells_enough(weighted(bounds)); }, deadline));
  });
}

LogInterval BoundedBelief::none_log_evidence() const {
  return found_ && found_->none ? *found_->none : LogInterval{-unlimited, -unlimited};
}

}  // namespace palpate
