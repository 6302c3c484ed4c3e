#include "leaf_evaluator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <tbb/parallel_for.h>

namespace palpate {

namespace {

constexpr std::size_t leaves_per_task = 16;
/// Memory for leaves that are not settled.
constexpr std::size_t most_pending_bytes = std::size_t{32} << 20;
/// Part of the tolerance that rounding may use up.
constexpr double rounding_part = 0.2;
/// Leaves that are evaluated in float64 before the clock is looked at again.
constexpr std::size_t refined_together = 2048;

}  // namespace

LeafEvaluator::LeafEvaluator(const BinLikelihood& likelihood, std::span<const double> log_weight,
                             const BoundedOptions& options, const KnownElements& elements,
                             const BinVisitor& visit, const Deadline& deadline,
                             MassAccount& account)
    : likelihood_(likelihood),
      log_weight_(log_weight),
      options_(options),
      elements_(elements),
      visit_(visit),
      deadline_(deadline),
      account_(account),
      pending_mass_(log_weight.size()) {
  for (std::size_t i = 0; i < log_weight.size(); ++i) {
    float32_error_.push_back(likelihood.float32_error(i, elements));
    float64_error_.push_back(likelihood.float64_error(i, elements));
  }
}

template <typename Float, typename Value>
void LeafEvaluator::evaluate(std::span<Leaf> leaves, std::span<Value> values) const {
  const std::size_t tasks = (leaves.size() + leaves_per_task - 1) / leaves_per_task;
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    thread_local std::vector<BinBox> boxes;
    thread_local std::vector<Float> logs;
    const std::span<Leaf> mine = leaves.subspan(
        task * leaves_per_task, std::min(leaves_per_task, leaves.size() - task * leaves_per_task));
    boxes.clear();
    std::size_t count = 0;
    for (const Leaf& leaf : mine) {
      boxes.push_back(leaf.box);
      count += static_cast<std::size_t>(leaf.box.bins());
    }
    logs.resize(count);
    likelihood_.evaluate(boxes, elements_, std::span<Float>(logs));
    const Float* from = logs.data();
    for (Leaf& leaf : mine) {
      const auto bins = static_cast<std::size_t>(leaf.box.bins());
      std::copy(from, from + bins, values.begin() + static_cast<std::ptrdiff_t>(leaf.first));
      leaf.largest = *std::max_element(from, from + bins);
      double sum = 0.0;
      for (std::size_t i = 0; i < bins; ++i) {
        sum += std::exp(static_cast<double>(from[i]) - leaf.largest);
      }
      leaf.log_mass = leaf.largest + std::log(sum);
      from += bins;
    }
  });
}

void LeafEvaluator::add(std::span<const BinBox> boxes) {
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
  evaluate<float>(added, std::span(values_));
  for (const Leaf& leaf : added) {
    const double least = log_weight_[leaf.box.object] - float32_error_[leaf.box.object];
    pending_mass_[leaf.box.object].add(least + leaf.log_mass);
    account_.raise_best(least + leaf.largest);
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
  std::vector<double> rounding(slots);
  for (const Leaf& leaf : pending_) {
    rounding[slot_of(leaf)] += std::expm1(float32_error_[leaf.box.object]) * share_of(leaf);
  }
  double left = (options_.tolerance * rounding_part - account_.rounding_share()) * share;
  std::size_t from = slots;
  for (; from > 0 && left >= rounding[from - 1]; --from) {
    left -= rounding[from - 1];
  }
  std::vector<std::size_t> refined;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    if (slot_of(pending_[i]) < from) {
      refined.push_back(i);
    }
  }
  return refined;
}

void LeafEvaluator::settle(double share) {
  const std::vector<std::size_t> refined = to_be_refined(share);
  std::vector<Leaf> exact;
  std::vector<double> values;
  std::size_t done = 0;
  for (; done < refined.size() && !deadline_.passed();) {
    const std::size_t end = std::min(done + refined_together, refined.size());
    exact.clear();
    std::size_t value = 0;
    for (std::size_t i = done; i < end; ++i) {
      exact.push_back(pending_[refined[i]]);
      exact.back().first = value;
      value += static_cast<std::size_t>(exact.back().box.bins());
    }
    values.resize(value);
    evaluate<double>(std::span(exact), std::span(values));
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
  account_.settle(leaf.box.object, leaf.log_mass, leaf.largest, error);
  account_.note_best(leaf.box, std::max_element(values.begin(), values.end()) - values.begin(),
                     leaf.largest);
  visit_(leaf.box, values);
}

}  // namespace palpate
