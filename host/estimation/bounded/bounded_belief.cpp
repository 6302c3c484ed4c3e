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

/// Tolerance that a search with a budget reaches before it goes on.
constexpr double first_tolerance = 1e-2;
/// How closely the log odds of "none of these" are known, in nats, unless this or the tolerance is
/// more than it, or the hypotheses, may have.
constexpr double none_nats = 0.3;
constexpr double negligible = 1e-4;
/// Bounds of the hypotheses' log evidence this far apart tell too little of them, in nats.
constexpr double untold_nats = 1.0;
constexpr double unlimited = std::numeric_limits<double>::infinity();

/// A bin of one hypothesis's lattice.
struct DrawnBin {
  std::int32_t object = 0;
  std::int64_t bin = 0;
};

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
    std::ranges::sort(draws_, {},
                      [](const DrawnBin& one) { return std::pair(one.object, one.bin); });
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
}

void BoundedBelief::move_pivot(const glm::dvec2& pivot_mm) {
  touches_.move_pivot(pivot_mm);
  found_.reset();
}

void BoundedBelief::take_in() {
  if (!touches_.waiting()) {
    return;
  }
  found_.reset();
  touches_.take_in();
}

SearchGoal BoundedBelief::goal(double tolerance) const {
  SearchGoal goal{tolerance, options().evidence_nats, options().evidence_range_nats};
  goal.poor_bins = options().poor_bins;
  const std::size_t touches = touches_.informative();
  if (goal.evidence_nats && touches > 1) {
    const double grown = 1.0 + options().evidence_growth * static_cast<double>(touches - 1);
    *goal.evidence_nats *= grown;
    goal.evidence_range_nats *= grown;
  }
  return goal;
}

const SearchResult& BoundedBelief::found(std::optional<double> asked) {
  const Deadline deadline = until(options().budget_s);
  const double tolerance = asked.value_or(this->tolerance());
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
        touches_.bound_none([&](const LogInterval& none) { return close_enough(none); }, deadline);
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
    first.tolerance = std::max(first.tolerance, first_tolerance);
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

std::vector<PoseSample> BoundedBelief::sample(std::size_t count, std::uint64_t seed) {
  found();
  Random random(seed, Stream::belief);
  BeliefDraws draws(one_in_each_part(count, random), options().lattice, touches_.log_weight(),
                    log_total());
  visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    draws.add(box, log_likelihood);
  });
  std::vector<PoseSample> samples;
  samples.reserve(count);
  for (const DrawnBin& drawn : draws.take()) {
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

bool BoundedBelief::close_enough(const LogInterval& none) const {
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
      !options().budget_s || (close_enough(none) && objects.high - objects.low <= untold_nats);
  if (told || !std::isfinite(all.evaluated)) {
    return std::isfinite(none.low) ? std::midpoint(none.low, none.high) : none.high;
  }
  const double prior_odds = touches_.none_log_weight() - std::log(options().lattice.bins());
  return all.evaluated + std::clamp(prior_odds, none.low - objects.high, none.high - objects.low);
}

}  // namespace palpate
