#include "estimation/bounded/bounded_belief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/bin_box.hpp"
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
/// Tolerance of a search for draws where touches are displaced: it takes little longer than a rough
/// one, and leaves so little out that its bins can be followed through the next touches. Two of
/// them raise that share up to a hundred times.
constexpr double followable = 1e-4;
/// How closely the log odds of "none of these" are known, in nats, unless this or the tolerance is
/// more than it, or the hypotheses, may have.
constexpr double none_nats = 0.05;
constexpr double negligible = 1e-4;
/// Bounds of the hypotheses' log evidence this far apart tell too little of them, in nats.
constexpr double untold_nats = 1.0;
constexpr double unlimited = std::numeric_limits<double>::infinity();

/// Draws bins from a belief whose bins come box by box, one in each of equal parts of the belief.
class BeliefDraws {
 public:
  /// @param targets ascending, as parts of the belief
  /// @param lattice,log_weight outlive this object; log_weight is [hypothesis], the log of its
  /// prior weight
  /// @param log_total log of the summed likelihood of all bins to come, with prior weights
  BeliefDraws(std::vector<double> targets, const PoseLattice& lattice,
              std::span<const double> log_weight, double log_total)
      : lattice_(lattice),
        log_weight_(log_weight),
        log_total_(log_total),
        targets_(std::move(targets)) {
    draws_.reserve(targets_.size());
  }

  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood) {
    const bool alike = log_likelihood.size() == 1;
    for (std::size_t i = 0; i < log_likelihood.size(); ++i) {
      const std::int64_t bins = alike ? box.bins() : 1;
      const double p = std::exp(log_weight_[box.object] - log_total_ + log_likelihood[i]);
      const double after = reached_ + p * static_cast<double>(bins);
      last_ = {box.object, box.bin(static_cast<std::int64_t>(i) + bins - 1, lattice_)};
      while (draws_.size() < targets_.size() && targets_[draws_.size()] < after) {
        const auto within = static_cast<std::int64_t>((targets_[draws_.size()] - reached_) / p);
        const std::int64_t bin = static_cast<std::int64_t>(i) + std::min(within, bins - 1);
        draws_.push_back({box.object, box.bin(bin, lattice_)});
      }
      reached_ = after;
    }
  }

  /// The draws, in the order of objects and bins.
  std::vector<DrawnBin> take() {
    draws_.resize(targets_.size(), last_);  // rounding may leave the last draw out
    std::ranges::sort(draws_, {}, &DrawnBin::place);
    return std::move(draws_);
  }

 private:
  const PoseLattice& lattice_;
  std::span<const double> log_weight_;
  double log_total_;
  std::vector<double> targets_;  ///< ascending, as parts of the belief
  std::vector<DrawnBin> draws_;
  double reached_ = 0.0;  ///< part of the belief that has come
  DrawnBin last_;         ///< the last bin that has come
};

}  // namespace

void BoundedBelief::reset() {
  touches_.reset();
  found_.reset();
  followed_.reset();
}

void BoundedBelief::move_pivot(const glm::dvec2& pivot_mm) {
  touches_.move_pivot(pivot_mm);
  found_.reset();
  followed_.reset();
}

void BoundedBelief::take_in() {
  if (!touches_.waiting()) {
    return;
  }
  if (found_ && found_->bins.complete() &&
      found_->bins.values().size() <= FollowedBins::most_bins(touches_.likelihood())) {
    followed_.emplace(found_->bins, found_->result, touches_.log_weight(), touches_.taken_in());
  }
  found_.reset();
  touches_.take_in();
}

SearchGoal BoundedBelief::goal(double tolerance) const {
  SearchGoal goal{tolerance, options().evidence_nats, options().evidence_range_nats};
  goal.poor_bins = options().poor_bins;
  const std::size_t touches = touches_.telling();
  if (touches == 1) {
    goal.evidence_range_nats =
        std::max(goal.evidence_range_nats, options().single_touch_range_nats);
  }
  if (goal.evidence_nats && touches > 1) {
    const double grown = 1.0 + options().evidence_growth * static_cast<double>(touches - 1);
    *goal.evidence_nats *= grown;
    goal.evidence_range_nats *= grown;
  }
  return goal;
}

double BoundedBelief::bins_in_all() const {
  return static_cast<double>(options().lattice.bins()) *
         static_cast<double>(touches_.hypotheses().size());
}

SearchGoal BoundedBelief::rough_goal() const {
  // Few bins take as long whatever the tolerance, and a close search lets those that are found be
  // followed through the next touches.
  const double rough = touches_.likelihood().displaced() ? followable : soon;
  return {.tolerance = bins_in_all() <= closely_drawn_bins ? options().tolerance
                                                           : std::max(options().tolerance, rough),
          .exact = false,
          .poor_bins = options().poor_bins};
}

const SearchResult& BoundedBelief::found(std::optional<double> asked) {
  const Deadline deadline = until(options().budget_s);
  const double tolerance = asked.value_or(this->tolerance());
  if (found_ && !found_->goal.exact) {
    found_.reset();
  }
  if (!found_ || tolerance < found_->tolerance) {
    // A budget may end the search before it proves as much as an earlier one.
    Found closer = search(tolerance);
    if (!found_ || better(closer, *found_)) {
      found_ = std::move(closer);
    }
    found_->tolerance = tolerance;
  }
  if (touches_.has_none() && !found_->none) {
    found_->none =
        touches_.bound_none([&](const LogInterval& none) { return tells_enough(none); }, deadline);
  }
  return found_->result;
}

BoundedBelief::Found BoundedBelief::search(double tolerance) {
  // "None of these" has the rest of a budget, which is half of it at least.
  std::optional<double> budget_s = options().budget_s;
  if (touches_.has_none() && budget_s) {
    *budget_s /= 2.0;
  }
  Deadline deadline = until(budget_s);
  SearchGoal first = goal(tolerance);
  if (deadline.exists()) {
    // What is proven soon comes first: a search that is cut short proves little.
    first.tolerance = std::max(first.tolerance, soon);
  }
  Found best = search(first, deadline);
  if (first.tolerance > tolerance && !deadline.passed()) {
    Found closer = search(goal(tolerance), deadline);
    if (better(closer, best)) {
      best = std::move(closer);
    }
  }
  return best;
}

BoundedBelief::Found BoundedBelief::search(const SearchGoal& goal, Deadline& deadline) {
  EvaluatedBins bins(deadline.exists());
  SearchResult result = touches_.search(
      goal, deadline, [&](const BinBox& box, std::span<const double> log_likelihood) {
        bins.add(box, log_likelihood);
        if (bins.full()) {
          // With a budget, bins are evaluated as long as there is room for them: another search
          // could not evaluate the same.
          deadline.end();
        }
      });
  return {std::move(result), std::move(bins), goal};
}

void BoundedBelief::visit(const BinVisitor& visitor) {
  if (found_->bins.complete()) {
    found_->bins.visit(visitor);
  } else {
    touches_.search(found_->goal, until({}), visitor);
  }
}

bool BoundedBelief::follow() {
  if (!followed_) {
    return false;
  }
  while (followed_->touches() < touches_.taken_in()) {
    touches_.follow(*followed_);
  }
  if (!(followed_->share_outside() <= soon)) {
    followed_.reset();
  }
  return followed_.has_value();
}

BoundedBelief::DrawnFrom BoundedBelief::drawable_bins() {
  if (found_ && found_->bins.complete()) {
    return DrawnFrom::found;
  }
  if (!found_ && follow()) {
    return DrawnFrom::followed;
  }
  // Rejection looks at tiles here and there, which share little of what displaced touches reach.
  const bool many_bins = bins_in_all() > most_searched_bins && options().touch_sd.none();
  // Where a search had no room for its bins, another one would take as long.
  if (found_ || touches_.taken_in() <= wide_touches || many_bins) {
    return DrawnFrom::tiles;
  }
  Deadline deadline = until(options().budget_s);
  found_ = search(rough_goal(), deadline);
  return DrawnFrom::found;
}

std::vector<DrawnBin> BoundedBelief::draw(std::size_t count, Random& random) {
  const DrawnFrom from = drawable_bins();
  if (from == DrawnFrom::tiles) {
    return touches_.draw(count, random, until(options().budget_s));
  }
  const bool followed = from == DrawnFrom::followed;
  BeliefDraws draws(one_in_each_part(count, random), options().lattice, touches_.log_weight(),
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
    samples.push_back({drawn.object, draw_within(drawn.bin, options().lattice, random)});
  }
  return samples;
}

std::vector<PoseBlock> BoundedBelief::refined_blocks() {
  const std::size_t finest = touches_.finest_level();
  std::vector<PoseBlock> blocks;
  std::vector<PoseBlock> evaluated;
  const auto note = [&](const BinBox& box, std::span<const double> log_likelihoods) {
    if (static_cast<std::int64_t>(log_likelihoods.size()) == box.bins()) {
      evaluated.push_back(block_of(box, finest));
    }
  };
  touches_.search(goal(tolerance()), until({}), note, &blocks);
  blocks.insert(blocks.end(), evaluated.begin(), evaluated.end());
  return blocks;
}

bool BoundedBelief::tells_enough(const LogInterval& none) const {
  const SearchGoal asked = goal(tolerance());
  const double range = asked.evidence_nats ? asked.evidence_range_nats
                                           : -std::log(std::max(asked.tolerance, negligible));
  // With a range, the evidence is for a temperature that is applied later, to "none of these", too.
  const bool for_temperature = asked.evidence_range_nats < unlimited;
  const double nats = asked.evidence_nats.value_or(none_nats);
  return none.high - none.low <= (for_temperature ? nats : std::min(nats, none_nats)) ||
         none.high < log_total() - range || none.low > log_total() + range;
}

LogInterval BoundedBelief::none_log_evidence() const {
  return found_ && found_->none ? *found_->none : LogInterval{-unlimited, -unlimited};
}

double BoundedBelief::none_estimate() const {
  if (!touches_.has_none()) {
    return -unlimited;
  }
  const LogInterval none = none_log_evidence();
  const HypothesisMass all = found_->result.all();
  const LogInterval objects = all.bounds();
  // Without a budget, a search of the hypotheses ends early where all fits are poor, which tells of
  // "none of these".
  const bool told =
      !options().budget_s || (tells_enough(none) && objects.high - objects.low <= untold_nats);
  if (told || !std::isfinite(all.evaluated)) {
    return std::isfinite(none.low) ? std::midpoint(none.low, none.high) : none.high;
  }
  const double prior_odds = touches_.none_log_weight() - std::log(options().lattice.bins());
  return all.evaluated + std::clamp(prior_odds, none.low - objects.high, none.high - objects.low);
}

}  // namespace palpate
