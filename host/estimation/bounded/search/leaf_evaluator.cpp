#include "estimation/bounded/search/leaf_evaluator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimation/bounded/parallel_for.hpp"
#include "estimation/bounded/touch_overlap.hpp"

namespace palpate {

namespace {

constexpr std::size_t leaves_per_task = 16;
/// Memory for leaves that are not settled.
constexpr std::size_t most_pending_bytes = std::size_t{32} << 20;
/// Part of the tolerance that rounding may use up.
constexpr double rounding_part = 0.2;
/// Products of bins and elements that are evaluated in float64 before the clock is looked at again.
constexpr double refined_together = 2e6;

/// Calls run(part) for parts of the leaves, in parallel.
template <typename Leaf, typename Run>
void for_tasks(std::span<Leaf> leaves, const Run& run) {
  const std::size_t tasks = (leaves.size() + leaves_per_task - 1) / leaves_per_task;
  parallel_for(tasks, [&](std::size_t task) {
    const std::size_t first = task * leaves_per_task;
    run(leaves.subspan(first, std::min(leaves_per_task, leaves.size() - first)));
  });
}

}  // namespace

LeafEvaluator::LeafEvaluator(const BinLikelihood& likelihood, std::span<const double> log_weight,
                             const SearchGoal& goal, const KnownElements& elements,
                             const BinVisitor& visit, const Deadline& deadline,
                             MassAccount& account)
    : likelihood_(likelihood),
      log_weight_(log_weight),
      goal_(goal),
      elements_(elements),
      visit_(visit),
      deadline_(deadline),
      account_(account),
      pending_mass_(log_weight.size()) {
  for (std::size_t i = 0; i < log_weight.size(); ++i) {
    float32_error_.push_back(likelihood.float32_error(i, elements));
    float64_error_.push_back(likelihood.float64_error(i, elements));
  }
  least_error_ = *std::max_element(float64_error_.begin(), float64_error_.end());
}

template <typename Value>
void LeafEvaluator::sum_up(std::span<Leaf> leaves, Value* values) const {
  for (Leaf& leaf : leaves) {
    Value* from = values + leaf.first;
    const auto bins = static_cast<std::size_t>(leaf.box.bins());
    if (goal_.counted != nullptr) {
      goal_.counted->leave_out_others(leaf.box, from);
    }
    leaf.largest = *std::max_element(from, from + bins);
    double sum = 0.0;
    for (std::size_t i = 0; i < bins; ++i) {
      sum += std::exp(static_cast<double>(from[i]) - leaf.largest);
    }
    leaf.log_mass = leaf.largest + std::log(sum);
  }
}

void LeafEvaluator::look(const BinBox& box) {
  std::vector<double> values(static_cast<std::size_t>(box.bins()));
  likelihood_.evaluate(std::span(&box, 1), elements_, std::span(values));
  bins_ += box.bins();
  account_.raise_best(box.object,
                      *std::max_element(values.begin(), values.end()) - float64_error_[box.object]);
}

void LeafEvaluator::evaluate_exactly(std::span<Leaf> leaves, std::span<double> values) const {
  for_tasks(leaves, [&](std::span<Leaf> mine) {
    thread_local std::vector<BinBox> boxes;
    boxes.clear();
    for (const Leaf& leaf : mine) {
      boxes.push_back(leaf.box);
    }
    const std::size_t end = mine.back().first + static_cast<std::size_t>(mine.back().box.bins());
    likelihood_.evaluate(boxes, elements_,
                         values.subspan(mine.front().first, end - mine.front().first));
    sum_up(mine, values.data());
  });
}

void LeafEvaluator::add(std::vector<BinBox> boxes) {
  if (goal_.counted != nullptr) {
    for (BinBox& box : boxes) {
      box = goal_.counted->cut(box);
    }
    std::erase_if(boxes, [](const BinBox& box) { return box.bins() == 0; });
  }
  if (boxes.empty()) {
    return;
  }
  const std::size_t first = pending_.size();
  std::size_t value = values_.size();
  for (const BinBox& box : boxes) {
    pending_.push_back({.box = box, .first = value});
    value += static_cast<std::size_t>(box.bins());
  }
  bins_ += static_cast<std::int64_t>(value - values_.size());
  values_.resize(value);
  const std::span<Leaf> added = std::span(pending_).subspan(first);
  likelihood_.evaluate_on_threads(boxes, elements_,
                                  std::span(values_).subspan(added.front().first));
  for_tasks(added, [&](std::span<Leaf> mine) { sum_up(mine, values_.data()); });
  for (const Leaf& leaf : added) {
    const double least = log_weight_[leaf.box.object] - float32_error_[leaf.box.object];
    pending_mass_[leaf.box.object].add(least + leaf.log_mass);
    account_.raise_best(leaf.box.object, leaf.largest - float32_error_[leaf.box.object]);
  }
  account_.raise_totals(pending_mass_);
  if (pending_.size() * sizeof(Leaf) + values_.size() * sizeof(float) > most_pending_bytes) {
    settle(0.5);
  }
}

std::vector<std::size_t> LeafEvaluator::to_be_refined(double share) const {
  // Leaves by their masses, in slots of 1/16 nat below the total: how much rounding each slot adds.
  constexpr std::size_t slots = 1024;
  constexpr double per_nat = 16.0;
  const auto share_of = [&](const Leaf& leaf) {
    return std::exp(log_weight_[leaf.box.object] + leaf.log_mass - account_.log_total());
  };
  const auto slot_of = [&](const Leaf& leaf) {
    const double below = account_.log_total() - log_weight_[leaf.box.object] - leaf.log_mass;
    return static_cast<std::size_t>(std::clamp(below * per_nat, 0.0, slots - 1.0));
  };
  const auto may_be_best = [&](const Leaf& leaf) {
    return goal_.mode &&
           log_weight_[leaf.box.object] + leaf.largest + float32_error_[leaf.box.object] >=
               account_.best();
  };
  const auto needs_evidence = [&](const Leaf& leaf) {
    return goal_.evidence_nats && 2.0 * std::expm1(float32_error_[leaf.box.object]) >
                                      evidence_rounding_part * *goal_.evidence_nats;
  };
  std::vector<double> rounding(slots);
  for (const Leaf& leaf : pending_) {
    rounding[slot_of(leaf)] += std::expm1(float32_error_[leaf.box.object]) * share_of(leaf);
  }
  const double left_part =
      goal_.tolerance * rounding_part + least_error_ - account_.rounding_share();
  double left = left_part * share;
  std::size_t from = slots;
  for (; from > 0 && left >= rounding[from - 1]; --from) {
    left -= rounding[from - 1];
  }
  std::vector<std::size_t> refined;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    if (slot_of(pending_[i]) < from || may_be_best(pending_[i]) || needs_evidence(pending_[i])) {
      refined.push_back(i);
    }
  }
  // Bins that may be the mode come first: it is told in float64 whatever the budget.
  std::stable_partition(refined.begin(), refined.end(),
                        [&](std::size_t i) { return may_be_best(pending_[i]); });
  return refined;
}

void LeafEvaluator::settle(double share) {
  const std::vector<std::size_t> refined =
      goal_.exact ? to_be_refined(share) : std::vector<std::size_t>();
  std::vector<Leaf> exact;
  std::vector<double> values;
  const auto elements = static_cast<double>(elements_.from_pivot_mm.size() + 1);
  std::size_t done = 0;
  while (done < refined.size() && (done == 0 || !deadline_.passed())) {
    exact.clear();
    std::size_t value = 0;
    std::size_t end = done;
    for (const auto most = static_cast<std::size_t>(refined_together / elements);
         end < refined.size() && (end == done || value < most); ++end) {
      exact.push_back(pending_[refined[end]]);
      exact.back().first = value;
      value += static_cast<std::size_t>(exact.back().box.bins());
    }
    values.resize(value);
    evaluate_exactly(exact, values);
    for (std::size_t i = done; i < end; ++i) {
      const Leaf& leaf = exact[i - done];
      settle(leaf, std::span(values).subspan(leaf.first, static_cast<std::size_t>(leaf.box.bins())),
             float64_error_[leaf.box.object]);
      pending_[refined[i]].box.y_count = 0;  // settled
    }
    done = end;
  }
  for (const Leaf& leaf : pending_) {
    if (const auto bins = static_cast<std::size_t>(leaf.box.bins()); bins > 0) {
      const auto from = values_.begin() + static_cast<std::ptrdiff_t>(leaf.first);
      values.assign(from, from + static_cast<std::ptrdiff_t>(bins));
      settle(leaf, values, float32_error_[leaf.box.object]);
    }
  }
  pending_.clear();
  values_.clear();
  pending_mass_.assign(pending_mass_.size(), {});
  account_.raise_totals(pending_mass_);
}

void LeafEvaluator::settle(const Leaf& leaf, std::span<const double> values, double error) {
  account_.settle(leaf.box.object, leaf.box.bins(), leaf.log_mass, leaf.largest, error);
  account_.note_best(leaf.box, std::max_element(values.begin(), values.end()) - values.begin(),
                     leaf.largest);
  visit_(leaf.box, values);
}

}  // namespace palpate
