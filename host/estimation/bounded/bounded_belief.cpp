#include "estimation/bounded/bounded_belief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <tbb/info.h>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/hypotheses.hpp"

namespace palpate {

namespace {

/// Tolerance that a search with a budget reaches before it goes on.
constexpr double first_tolerance = 1e-2;
/// How closely the log odds of "none of these" are known, in nats, unless this or the tolerance is
/// more than it, or the hypotheses, may have.
constexpr double none_nats = 0.3;
constexpr double negligible = 1e-4;
/// Bounds of the hypotheses' log evidence this far apart tell too little of them, in nats.
constexpr double untold_nats = 1.0;
constexpr double unlimited = std::numeric_limits<double>::infinity();

}  // namespace

BoundedBelief::BoundedBelief(std::span<const Hypothesis> hypotheses, const BoundedOptions& options)
    : options_(options),
      hypotheses_(hypotheses.begin(), hypotheses.end()),
      // More threads than cores gain nothing.
      arena_(options.threads > 0 ? std::min(options.threads, tbb::info::default_concurrency())
                                 : tbb::info::default_concurrency()),
      likelihood_(hypotheses_, options_.contact, options_.lattice, options_.touch_sd),
      space_(arena_.execute([&] { return SearchSpace(hypotheses_, options_); })),
      largest_(space_) {
  if (options_.none_weight) {
    none_.emplace(space_, options_, likelihood_);
    none_log_weight_ = none_log_weight(*options_.none_weight, hypotheses_, options_.lattice);
  }
}

void BoundedBelief::reset() {
  change_.forget();
  touches_.clear();
  taken_in_ = 0;
  informative_ = 0;
  elements_ = {};
  largest_.reset();
  if (none_) {
    none_->reset();
  }
  found_.reset();
}

void BoundedBelief::move_pivot(const glm::dvec2& pivot_mm) {
  options_.lattice = with_pivot(options_.lattice, pivot_mm, "bounded posterior", taken_in_ > 0);
  likelihood_.move_pivot(pivot_mm);
  found_.reset();
}

KeptTouches& BoundedBelief::kept() {
  change_.refuse();
  return touches_;
}

void BoundedBelief::take_in() {
  change_.refuse();
  if (taken_in_ == touches_.size()) {
    return;
  }
  found_.reset();
  change_.change([&] {
    const std::span<const TouchEvidence> added = touches_.all().subspan(taken_in_);
    std::vector<KnownElements> known;
    for (const TouchEvidence& touch : added) {
      known.push_back(known_elements(touch, options_));
      for (KnownElements& displaced : known.back().touches) {
        displaced.undisplaced_bins = std::make_shared<UndisplacedBins>(
            hypotheses_.size(), space_.turns.size(), UndisplacedBins::most_bytes / touches_.size());
      }
    }
    arena_.execute([&] { largest_.add(known); });
    known.insert(known.begin(), std::move(elements_));
    elements_ = merged(known);
    if (none_) {
      none_->add(added);
    }
    taken_in_ = touches_.size();
    informative_ += static_cast<std::size_t>(std::ranges::count_if(added, &TouchEvidence::tells));
  });
}

std::string BoundedBelief::path() const {
  const int threads = arena_.max_concurrency();
  return fmt::format("{} on {} thread{}", vector_instructions(), threads, threads == 1 ? "" : "s");
}

std::uint64_t BoundedBelief::bytes() const {
  std::uint64_t bytes = likelihood_.bytes() + space_.bytes() + largest_.bytes();
  for (const KnownElements& touch : elements_.touches) {
    bytes += touch.undisplaced_bins->bytes();
  }
  return bytes + (none_ ? none_->bytes() : 0) + (found_ ? found_->bins.bytes() : 0);
}

std::vector<double> BoundedBelief::log_likelihood(std::span<const BinBox> boxes,
                                                  const BinLikelihood& likelihood) const {
  std::vector<double> logs(bins_in(boxes));
  arena_.execute([&] { likelihood.evaluate(boxes, elements_, logs); });
  return logs;
}

SearchGoal BoundedBelief::goal(double tolerance) const {
  SearchGoal goal{tolerance, options_.evidence_nats, options_.evidence_range_nats,
                  options_.poor_bins};
  if (goal.evidence_nats && informative_ > 1) {
    const double grown = 1.0 + options_.evidence_growth * static_cast<double>(informative_ - 1);
    *goal.evidence_nats *= grown;
    goal.evidence_range_nats *= grown;
  }
  return goal;
}

const SearchResult& BoundedBelief::found(std::optional<double> asked) {
  const Deadline deadline = until(options_.budget_s);
  const double tolerance = asked.value_or(this->tolerance());
  if (!found_ || tolerance < found_->tolerance) {
    // A budget may end the search before it proves as much as an earlier one.
    Found closer = find(tolerance);
    if (!found_ || better(closer, *found_)) {
      found_ = std::move(closer);
    }
    found_->tolerance = tolerance;
  }
  if (none_ && !found_->none) {
    found_->none = bound_none(deadline);
  }
  return found_->result;
}

BoundedBelief::Found BoundedBelief::find(double tolerance) {
  // "None of these" has the rest of a budget, which is half of it at least.
  std::optional<double> budget_s = options_.budget_s;
  if (none_ && budget_s) {
    *budget_s /= 2.0;
  }
  Deadline deadline = until(budget_s);
  SearchGoal first = goal(tolerance);
  if (deadline.exists()) {
    // What is proven soon comes first: a search that is cut short proves little.
    first.tolerance = std::max(first.tolerance, first_tolerance);
  }
  Found best = find(first, deadline);
  if (first.tolerance > tolerance && !deadline.passed()) {
    Found closer = find(goal(tolerance), deadline);
    if (better(closer, best)) {
      best = std::move(closer);
    }
  }
  return best;
}

BoundedBelief::Found BoundedBelief::find(const SearchGoal& goal, Deadline& deadline) {
  EvaluatedBins bins(deadline.exists());
  SearchResult result =
      search(goal, deadline, [&](const BinBox& box, std::span<const double> log_likelihood) {
        bins.add(box, log_likelihood);
        if (bins.full()) {
          // With a budget, bins are evaluated as long as there is room for them: another search
          // could not evaluate the same.
          deadline.end();
        }
      });
  return {std::move(result), std::move(bins), goal};
}

SearchResult BoundedBelief::search(const SearchGoal& goal, const Deadline& deadline,
                                   const BinVisitor& visitor, std::vector<PoseBlock>* refined) {
  return arena_.execute([&] {
    return run_search({space_, options_, likelihood_, elements_, goal, deadline, visitor}, largest_,
                      refined);
  });
}

void BoundedBelief::visit(const BinVisitor& visitor) {
  found();
  if (found_->bins.complete()) {
    found_->bins.visit(visitor);
  } else {
    search(found_->goal, until({}), visitor);
  }
}

BinBelief BoundedBelief::bins() {
  const SearchResult& result = found();
  BinBelief all{.lattice = options_.lattice,
                .objects = {},
                .visit = [this](std::span<const int> objects, const BlockChoice& /*all*/,
                                const BinVisitor& visitor) {
                  std::vector<std::uint8_t> asked(hypotheses_.size());
                  for (const int object : objects) {
                    asked[object] = 1;
                  }
                  visit([&](const BinBox& box, std::span<const double> log_likelihood) {
                    if (asked[box.object] != 0) {
                      visitor(box, log_likelihood);
                    }
                  });
                }};
  const double log_total = result.all().evaluated;
  for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
    const double evaluated = result.mass[i].evaluated;
    all.objects.push_back(
        {.log_share = space_.log_weight[i] - evaluated, .log_identity = evaluated - log_total});
  }
  all.log_objects = log_total - log_add(log_total, none_estimate());
  return all;
}

std::vector<PoseBlock> BoundedBelief::refined_blocks() {
  std::vector<PoseBlock> blocks;
  std::vector<PoseBlock> evaluated;
  const auto note = [&](const BinBox& box, std::span<const double> log_likelihoods) {
    if (static_cast<std::int64_t>(log_likelihoods.size()) == box.bins()) {
      evaluated.push_back(block_of(box, space_.finest_level()));
    }
  };
  search(goal(tolerance()), until({}), note, &blocks);
  blocks.insert(blocks.end(), evaluated.begin(), evaluated.end());
  return blocks;
}

LogInterval BoundedBelief::bound_none(const Deadline& deadline) {
  const auto weighted = [&](const LogInterval& bounds) {
    return LogInterval{none_log_weight_ + bounds.low, none_log_weight_ + bounds.high};
  };
  const auto enough = [&](const LogInterval& bounds) { return close_enough(weighted(bounds)); };
  return weighted(arena_.execute([&] { return none_->bounds(enough, deadline); }));
}

bool BoundedBelief::close_enough(const LogInterval& none) const {
  const SearchGoal asked = goal(tolerance());
  const double range = asked.evidence_nats ? asked.evidence_range_nats
                                           : -std::log(std::max(asked.tolerance, negligible));
  // With a range, the evidence is for a temperature that is applied later, to "none of these", too.
  const bool for_temperature = asked.evidence_range_nats < unlimited;
  const double nats = asked.evidence_nats.value_or(none_nats);
  const double objects = found_->result.all().evaluated;
  return none.high - none.low <= (for_temperature ? nats : std::min(nats, none_nats)) ||
         none.high < objects - range || none.low > objects + range;
}

LogInterval BoundedBelief::none_log_evidence() const {
  return found_ && found_->none ? *found_->none : LogInterval{-unlimited, -unlimited};
}

double BoundedBelief::none_estimate() const {
  if (!none_) {
    return -unlimited;
  }
  const LogInterval none = none_log_evidence();
  const HypothesisMass all = found_->result.all();
  const LogInterval objects = all.bounds();
  // Without a budget, a search of the hypotheses ends early where all fits are poor, which tells of
  // "none of these".
  const bool told =
      !options_.budget_s || (close_enough(none) && objects.high - objects.low <= untold_nats);
  if (told || !std::isfinite(all.evaluated)) {
    return std::isfinite(none.low) ? std::midpoint(none.low, none.high) : none.high;
  }
  const double prior_odds = none_log_weight_ - std::log(options_.lattice.bins());
  return all.evaluated + std::clamp(prior_odds, none.low - objects.high, none.high - objects.low);
}

}  // namespace palpate
