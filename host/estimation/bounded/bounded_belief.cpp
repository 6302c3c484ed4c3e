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
#include "estimation/moved_pivot.hpp"

namespace palpate {

namespace {

/// Tolerance that a search with a budget reaches before it goes on, and enough to draw samples.
constexpr double soon = 1e-2;
/// Bins of all hypotheses together up to which samples are drawn at the full tolerance.
constexpr double closely_drawn_bins = 1e6;
/// Bounds of "none of these" need not be so close that identities move by less.
constexpr double least_identity_change = 1e-6;
constexpr double unbounded = std::numeric_limits<double>::infinity();

}  // namespace

BoundedBelief::BoundedBelief(Device* device, std::span<const Hypothesis> hypotheses,
                             const BoundedOptions& options)
    : options_(options),
      hypotheses_(hypotheses.begin(), hypotheses.end()),
      // More threads than cores gain nothing.
      threads_(options.threads > 0 ? std::min(options.threads, tbb::info::default_concurrency())
                                   : tbb::info::default_concurrency()),
      arena_(threads_),
      likelihood_(hypotheses_, options_.contact, options_.lattice),
      batches_(likelihood_, device != nullptr ? &device->context() : nullptr, hypotheses_,
               options_.contact, options_.lattice,
               device != nullptr ? BinPlace::measured : BinPlace::host),
      space_(arena_.execute([&] { return SearchSpace(hypotheses_, options_); })),
      search_(space_, options_, likelihood_, batches_) {
  if (options_.none_weight) {
    none_.emplace(space_, options_, likelihood_, batches_);
    none_log_weight_ = std::log(*options_.none_weight) - log_total_weight(hypotheses_) +
                       std::log(static_cast<double>(options_.lattice.bins()));
  }
}

void BoundedBelief::reset() {
  half_done_.forget();
  kept_.clear();
  elements_ = {};
  touches_ = 0;
  not_added_.clear();
  search_.reset();
  result_.reset();
  followed_.reset();
  if (none_) {
    none_->reset();
  }
}

void BoundedBelief::move_pivot(const glm::dvec2& pivot_mm) {
  options_.lattice = with_pivot(options_.lattice, pivot_mm, "bounded posterior", touches_ > 0);
  likelihood_.move_pivot(pivot_mm);
  batches_.move_pivot(pivot_mm);
  result_.reset();
  followed_.reset();
}

void BoundedBelief::add(std::span<const Touch> touches) {
  half_done_.refuse();
  kept_.add(touches, options_.contact, options_.lattice.pivot_mm);
  touches_ += touches.size();
}

void BoundedBelief::take_in() {
  half_done_.refuse();
  if (kept_.empty()) {
    return;
  }
  half_done_.change([&] {
    const std::vector<ArrayReadings> touches = kept_.all();
    std::vector<KnownElements> all;
    for (const ArrayReadings& touch : touches) {
      all.push_back(known_elements(touch));
    }
    follow(all);
    all.push_back(std::move(elements_));
    elements_ = merged(all);
    not_added_.insert(not_added_.end(), touches.begin(), touches.end());
    if (none_) {
      none_->add(touches);
    }
    kept_.clear();
  });
}

std::string BoundedBelief::path() const {
  return fmt::format("{} on {} thread{}, {}", likelihood_.instructions(), threads_,
                     threads_ == 1 ? "" : "s", batches_.path());
}

std::uint64_t BoundedBelief::bytes() const {
  std::uint64_t bytes = likelihood_.bytes() + space_.bytes() + search_.bytes() + bins_.bytes();
  return none_ ? bytes + none_->bytes() : bytes;
}

Deadline BoundedBelief::until(const std::optional<double>& budget_s) const {
  return Deadline(budget_s, &options_.cancel_point);
}

SearchGoal BoundedBelief::goal() const {
  SearchGoal goal{options_.tolerance, options_.evidence_nats, options_.evidence_range_nats};
  if (goal.evidence_nats && touches_ > 1) {
    const double grown = 1.0 + options_.evidence_growth * static_cast<double>(touches_ - 1);
    *goal.evidence_nats *= grown;
    goal.evidence_range_nats *= grown;
  }
  return goal;
}

SearchGoal BoundedBelief::rough_goal() const {
  // Few bins take as long whatever the tolerance, and a close search lets those that are found be
  // followed through the next touches.
  const double all =
      static_cast<double>(options_.lattice.bins()) * static_cast<double>(hypotheses_.size());
  return {.tolerance =
              all <= closely_drawn_bins ? options_.tolerance : std::max(options_.tolerance, soon),
          .exact = false};
}

const SearchResult& BoundedBelief::found() {
  const Deadline deadline = until(options_.budget_s);
  if (!result_ || rough_) {
    result_.reset();
    rough_ = false;
    none_log_evidence_.reset();
    result_ = search();
  }
  bound_none(deadline);
  return *result_;
}

SearchResult BoundedBelief::search() {
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
  SearchResult best = run(first, deadline, bins_);
  if (first.tolerance > options_.tolerance && !deadline.passed()) {
    EvaluatedBins more(true);
    SearchResult better = run(goal(), deadline, more);
    if (better.uncertain() < best.uncertain()) {
      best = std::move(better);
      bins_ = std::move(more);
    }
  }
  return best;
}

void BoundedBelief::find_roughly() {
  if (!result_) {
    Deadline deadline = until(options_.budget_s);
    result_ = run(rough_goal(), deadline, bins_);
    rough_ = true;
  }
}

SearchResult BoundedBelief::run(const SearchGoal& goal, Deadline& deadline,
                                EvaluatedBins& evaluated) {
  evaluated.clear();
  add_to_search();
  return arena_.execute([&] {
    return search_.run(elements_, goal, deadline,
                       [&](const BinBox& box, std::span<const double> log_likelihood) {
                         evaluated.add(box, log_likelihood);
                         if (evaluated.full()) {
                           // With a budget, bins are evaluated as long as there is room for them:
                           // another search could not evaluate the same.
                           deadline.end();
                         }
                       });
  });
}

void BoundedBelief::add_to_search() {
  if (!not_added_.empty()) {
    half_done_.change([&] { arena_.execute([&] { search_.add(not_added_); }); });
    not_added_.clear();
  }
}

void BoundedBelief::visit(const BinVisitor& visitor) {
  if (bins_.complete()) {
    bins_.visit(visitor);
  } else {
    arena_.execute(
        [&] { search_.run(elements_, rough_ ? rough_goal() : goal(), until({}), visitor); });
  }
}

double BoundedBelief::log_total() const {
  LogSum total;
  for (const HypothesisEvidence& evidence : result_->evidence) {
    total.add(evidence.evaluated);
  }
  return total.log();
}

void BoundedBelief::follow(std::span<const KnownElements> touches) {
  if (result_ && bins_.complete() && bins_.values() <= FollowedBins::most_bins) {
    followed_.emplace(bins_, *result_, space_.log_weight);
    not_followed_.clear();
  }
  if (followed_) {
    not_followed_.insert(not_followed_.end(), touches.begin(), touches.end());
  }
  result_.reset();
}

const FollowedBins* BoundedBelief::followed_bins() {
  if (result_ || !followed_) {
    return nullptr;
  }
  for (const KnownElements& touch : std::exchange(not_followed_, {})) {
    std::vector<double> most;
    for (const TileBounds& bounds : space_.bounds) {
      most.push_back(bounds.best(bounds.levels().size() - 1, touch));
    }
    followed_->add(touch, likelihood_, most);
  }
  if (!(followed_->share_outside() <= soon)) {
    followed_.reset();
    return nullptr;
  }
  return &*followed_;
}

std::vector<PoseSample> BoundedBelief::sample(std::size_t count, std::uint64_t seed) {
  const FollowedBins* followed = followed_bins();
  if (followed == nullptr) {
    find_roughly();
  }
  BeliefDraws draws(count, seed, options_.lattice, space_.log_weight,
                    followed != nullptr ? followed->log_total() : log_total());
  const auto add = [&](const BinBox& box, std::span<const double> log_likelihood) {
    draws.add(box, log_likelihood);
  };
  if (followed != nullptr) {
    followed->visit(add);
  } else {
    visit(add);
  }
  return draws.take();
}

std::vector<PoseBlock> BoundedBelief::refined_blocks() {
  add_to_search();
  std::vector<PoseBlock> blocks;
  std::vector<PoseBlock> evaluated;
  const auto note = [&](const BinBox& box, std::span<const double> log_likelihoods) {
    if (static_cast<std::int64_t>(log_likelihoods.size()) == box.bins()) {
      evaluated.push_back({.object = box.object,
                           .level = search_.finest_level(),
                           .theta = box.theta,
                           .x_first = box.x_first,
                           .x_count = box.x_count,
                           .y_first = box.y_first,
                           .y_count = box.y_count});
    }
  };
  arena_.execute([&] { search_.run(elements_, goal(), until({}), note, &blocks); });
  blocks.insert(blocks.end(), evaluated.begin(), evaluated.end());
  return blocks;
}

double BoundedBelief::allowed_none_width(const LogInterval& none) const {
  const double objects = log_total();
  const auto probability = [&](double log_evidence) {
    return 1.0 / (1.0 + std::exp(objects - log_evidence));
  };
  const double allowed = std::max(options_.tolerance, least_identity_change);
  const double low = probability(none.low);
  const double high = probability(none.high);
  if (high - low <= allowed) {
    return unbounded;
  }
  // The probability changes by at most so much a nat.
  const double p = std::clamp(0.5, low, high);
  return allowed / (p * (1.0 - p));
}

void BoundedBelief::bound_none(const Deadline& deadline) {
  if (!none_ || none_log_evidence_) {
    return;
  }
  double width = goal().evidence_nats.value_or(unbounded);
  for (LogInterval last{-unbounded, unbounded};;) {
    const LogInterval bounds = arena_.execute([&] { return none_->bounds(width, deadline); });
    const LogInterval weighted{none_log_weight_ + bounds.low, none_log_weight_ + bounds.high};
    width = std::min(width, allowed_none_width(weighted));
    const bool narrowed = bounds.high - bounds.low < last.high - last.low;
    last = bounds;
    if (bounds.high - bounds.low <= width || !narrowed || deadline.passed()) {
      none_log_evidence_ = weighted;
      return;
    }
  }
}

LogInterval BoundedBelief::none_log_evidence() const {
  return none_log_evidence_.value_or(LogInterval{-unbounded, -unbounded});
}

}  // namespace palpate
