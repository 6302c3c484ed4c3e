#include "leaf_pass.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <tuple>
#include <type_traits>

#include <tbb/parallel_for.h>

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();
/// Part of the tolerance that rounding may use up.
constexpr double rounding_share = 0.2;
/// Leaves that are evaluated before the total is looked at again: few at first, for the best ones
/// raise it most.
constexpr std::size_t first_batch = 512;
constexpr std::size_t largest_batch = 8192;
constexpr std::size_t leaves_per_task = 16;

}  // namespace

LeafPass::LeafPass(const BinLikelihood& likelihood, std::span<const TileBounds> bounds,
                   std::span<const double> log_weight, const BoundedOptions& options,
                   const KnownElements& elements, const BinVisitor& visit)
    : likelihood_(likelihood),
      bounds_(bounds),
      log_weight_(log_weight),
      options_(options),
      elements_(elements),
      visit_(visit),
      evaluated_(bounds.size()),
      rounding_(bounds.size()),
      dropped_(bounds.size()),
      log_total_(nothing),
      log_totals_(bounds.size(), nothing),
      best_(nothing),
      largest_dropped_(nothing),
      mode_value_(nothing) {
  if (options.budget_s) {
    deadline_ = std::chrono::steady_clock::now() +
                std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                    std::chrono::duration<double>(*options.budget_s));
  }
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    float32_error_.push_back(likelihood.float32_error(i, elements));
    float64_error_.push_back(likelihood.float64_error(i, elements));
    double prior = 0.0;
    for (const ReadingRun& run : elements.runs) {
      prior += static_cast<double>(run.end - run.begin) *
               options.contact.log_likelihood(
                   run.reading, {log_odds_from_probability(*options.contact.prior)}, i);
    }
    prior_likelihood_.push_back(prior);
  }
}

bool LeafPass::out_of_time() const {
  return deadline_ && std::chrono::steady_clock::now() >= *deadline_;
}

double LeafPass::dropped_share() const { return std::exp(all_dropped_.log() - log_total_); }

BinBox LeafPass::box_of(const Tile& tile) const {
  const TileLevel& level = bounds_[tile.object].levels().back();
  return {.object = tile.object,
          .theta = tile.theta,
          .y_first = level.y.first_bin[tile.y],
          .y_count = level.y.bins(tile.y),
          .x_first = level.x.first_bin[tile.x],
          .x_count = level.x.bins(tile.x)};
}

std::vector<LeafPass::Leaf> LeafPass::leaves_of(std::span<const Tile> tiles) const {
  std::vector<Leaf> leaves;
  leaves.reserve(tiles.size());
  for (const Tile& tile : tiles) {
    leaves.push_back({.box = box_of(tile)});
  }
  std::sort(leaves.begin(), leaves.end(), [](const Leaf& a, const Leaf& b) {
    return std::tie(a.box.object, a.box.theta, a.box.y_first, a.box.x_first) <
           std::tie(b.box.object, b.box.theta, b.box.y_first, b.box.x_first);
  });
  std::size_t first = 0;
  for (Leaf& leaf : leaves) {
    leaf.first = first;
    first += static_cast<std::size_t>(leaf.box.bins());
  }
  return leaves;
}

template <typename Float>
void LeafPass::evaluate_leaves(std::span<Leaf> leaves, std::span<double> values) const {
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

void LeafPass::note_totals() {
  // What rounding may have added does not count.
  log_total_ = std::max(log_total_, log_subtract(all_evaluated_.log(), all_rounding_.log()));
  for (std::size_t i = 0; i < evaluated_.size(); ++i) {
    log_totals_[i] =
        std::max(log_totals_[i], log_subtract(evaluated_[i].log(), rounding_[i].log()));
  }
}

void LeafPass::probe(std::span<const Tile> tiles) {
  std::vector<Leaf> leaves = leaves_of(tiles);
  if (leaves.empty()) {
    return;
  }
  std::vector<double> values(leaves.back().first +
                             static_cast<std::size_t>(leaves.back().box.bins()));
  evaluate_leaves<float>(leaves, values);
  LogSum total;
  std::vector<LogSum> totals(log_totals_.size());
  for (const Leaf& leaf : leaves) {
    const double weight = log_weight_[leaf.box.object] - float32_error_[leaf.box.object];
    total.add(weight + leaf.log_mass);
    totals[leaf.box.object].add(weight + leaf.log_mass);
    best_ = std::max(best_, weight + leaf.largest);
  }
  result_.bins_evaluated += static_cast<std::int64_t>(values.size());
  log_total_ = std::max(log_total_, total.log());
  for (std::size_t i = 0; i < totals.size(); ++i) {
    log_totals_[i] = std::max(log_totals_[i], totals[i].log());
  }
}

UnsettledMass LeafPass::unsettled(std::span<const Tile> tiles, std::size_t level) const {
  double largest = nothing;
  for (const Tile& tile : tiles) {
    largest = std::max(largest, tile.bound);
  }
  UnsettledMass unsettled(bounds_.size(), largest);
  for (const Tile& tile : tiles) {
    unsettled.add(static_cast<std::size_t>(tile.object), tile.bound,
                  bounds_[tile.object].bins(level, tile));
  }
  return unsettled;
}

std::vector<std::size_t> LeafPass::droppable_from(const UnsettledMass& tiles,
                                                  double tolerance) const {
  const std::size_t of_all = std::max(tiles.droppable_from(std::log(tolerance) + log_total_),
                                      tiles.slot(best_) + 1);  // the mode must not be lost
  std::vector<std::size_t> from(bounds_.size(), of_all);
  if (options_.evidence_nats) {
    // Of each hypothesis's own mass, as large a part of what may be missing.
    const double missing = std::expm1(*options_.evidence_nats) * tolerance / options_.tolerance;
    for (std::size_t i = 0; i < from.size(); ++i) {
      from[i] = std::max(of_all, tiles.droppable_from(i, std::log(missing) + log_totals_[i]));
    }
  }
  return from;
}

void LeafPass::drop(const UnsettledMass& tiles) {
  for (std::size_t i = 0; i < dropped_.size(); ++i) {
    const double mass = tiles.log_mass(i);
    dropped_[i].add(mass);
    all_dropped_.add(mass);
  }
  largest_dropped_ = std::max(largest_dropped_, tiles.largest());
}

void LeafPass::evaluate(std::span<const Tile> tiles, double tolerance) {
  if (tiles.empty()) {
    return;
  }
  const std::size_t finest = bounds_.front().levels().size() - 1;
  UnsettledMass left = unsettled(tiles, finest);
  std::vector<std::size_t> from = droppable_from(left, tolerance);
  // Tiles in the order of their slots, by counting.
  std::vector<std::size_t> begins(UnsettledMass::slots + 1);
  for (const Tile& tile : tiles) {
    if (const std::size_t slot = left.slot(tile.bound); slot < from[tile.object]) {
      ++begins[slot + 1];
    }
  }
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<Tile> ordered(begins.back());
  for (const Tile& tile : tiles) {
    if (const std::size_t slot = left.slot(tile.bound); slot < from[tile.object]) {
      ordered[begins[slot]++] = tile;
    }
  }
  std::vector<Tile> batch;
  std::size_t size = first_batch;
  for (std::size_t next = 0; next < ordered.size() && !out_of_time();) {
    batch.clear();
    for (; next < ordered.size() && batch.size() < size; ++next) {
      const Tile& tile = ordered[next];
      if (left.slot(tile.bound) < from[tile.object]) {
        batch.push_back(tile);
        left.remove(static_cast<std::size_t>(tile.object), tile.bound,
                    bounds_[tile.object].bins(finest, tile));
      }
    }
    if (!batch.empty()) {
      evaluate_batch(batch);
      from = droppable_from(left, tolerance);
    }
    size = std::min(2 * size, largest_batch);
  }
  drop(left);
}

std::vector<LeafPass::Leaf*> LeafPass::to_be_refined(std::span<Leaf> leaves) const {
  std::vector<Leaf*> by_mass;
  by_mass.reserve(leaves.size());
  for (Leaf& leaf : leaves) {
    by_mass.push_back(&leaf);
  }
  const auto mass = [&](const Leaf* leaf) {
    return log_weight_[leaf->box.object] + leaf->log_mass;
  };
  std::sort(by_mass.begin(), by_mass.end(),
            [&](const Leaf* a, const Leaf* b) { return mass(a) < mass(b); });
  // Half of what is left, for the leaves to come.
  const double used = std::exp(all_rounding_.log() - log_total_);
  double left = (options_.tolerance * rounding_share - used) / 2.0;
  auto refined = by_mass.begin();
  for (; refined != by_mass.end(); ++refined) {
    left -=
        std::expm1(float32_error_[(*refined)->box.object]) * std::exp(mass(*refined) - log_total_);
    if (left < 0.0) {
      break;
    }
  }
  return {refined, by_mass.end()};
}

void LeafPass::account(const Leaf& leaf, std::span<const double> values, double error) {
  const double weight = log_weight_[leaf.box.object];
  const double mass = weight + leaf.log_mass;
  evaluated_[leaf.box.object].add(mass);
  all_evaluated_.add(mass);
  const double rounding = mass + std::log(std::expm1(error));
  rounding_[leaf.box.object].add(rounding);
  all_rounding_.add(rounding);
  best_ = std::max(best_, weight + leaf.largest - error);
  note_best(leaf.box, std::max_element(values.begin(), values.end()) - values.begin(),
            leaf.largest);
  visit_(leaf.box, values);
}

void LeafPass::note_best(const BinBox& box, std::int64_t bin_of_box, double log_likelihood) {
  const PoseLattice& in = options_.lattice;
  const std::int64_t bin =
      (std::int64_t{box.theta} * in.y_mm.count + box.y_first + bin_of_box / box.x_count) *
          in.x_mm.count +
      box.x_first + bin_of_box % box.x_count;
  const double value = log_weight_[box.object] + log_likelihood;
  // Of equal bins the first one is the mode.
  if (value > mode_value_ ||
      (value == mode_value_ &&
       std::tie(box.object, bin) < std::tie(result_.best_object, result_.best_bin))) {
    mode_value_ = value;
    result_.best_object = box.object;
    result_.best_bin = bin;
    result_.best_log_likelihood = log_likelihood;
  }
}

void LeafPass::settle_unseen(const BinBox& box) {
  const double value = prior_likelihood_[box.object];
  const double mass = log_weight_[box.object] + value + std::log(static_cast<double>(box.bins()));
  evaluated_[box.object].add(mass);
  all_evaluated_.add(mass);
  const double rounding = mass + std::log(std::expm1(float64_error_[box.object]));
  rounding_[box.object].add(rounding);
  all_rounding_.add(rounding);
  best_ = std::max(best_, log_weight_[box.object] + value - float64_error_[box.object]);
  note_best(box, 0, value);
  note_totals();
  visit_(box, std::span(&value, 1));
}

void LeafPass::evaluate_batch(std::span<const Tile> tiles) {
  std::vector<Leaf> leaves = leaves_of(tiles);
  std::vector<double> values(leaves.back().first +
                             static_cast<std::size_t>(leaves.back().box.bins()));
  evaluate_leaves<float>(leaves, values);
  {
    LogSum total;
    for (const Leaf& leaf : leaves) {
      total.add(log_weight_[leaf.box.object] + leaf.log_mass - float32_error_[leaf.box.object]);
    }
    log_total_ = std::max(log_total_, total.log());
  }
  std::vector<Leaf*> refined = to_be_refined(leaves);
  std::sort(refined.begin(), refined.end());
  std::vector<Leaf> exact;
  exact.reserve(refined.size());
  for (const Leaf* leaf : refined) {
    exact.push_back(*leaf);
  }
  evaluate_leaves<double>(exact, values);
  result_.bins_evaluated += static_cast<std::int64_t>(values.size());
  auto next = refined.begin();
  std::size_t refined_so_far = 0;
  for (Leaf& leaf : leaves) {
    const bool is_exact = next != refined.end() && *next == &leaf;
    const Leaf& known = is_exact ? exact[refined_so_far] : leaf;
    if (is_exact) {
      ++next;
      ++refined_so_far;
    }
    account(known,
            std::span(values).subspan(known.first, static_cast<std::size_t>(known.box.bins())),
            is_exact ? float64_error_[leaf.box.object] : float32_error_[leaf.box.object]);
  }
  note_totals();
}

SearchResult LeafPass::result() const {
  SearchResult result = result_;
  for (std::size_t i = 0; i < evaluated_.size(); ++i) {
    result.evidence.push_back({.evaluated = evaluated_[i].log(),
                               .rounding = rounding_[i].log(),
                               .dropped = dropped_[i].log()});
  }
  result.mode_certain = largest_dropped_ < mode_value_;
  return result;
}

}  // namespace palpate
