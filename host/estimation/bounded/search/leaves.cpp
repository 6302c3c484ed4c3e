#include "estimation/bounded/search/leaves.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/parallel_for.hpp"
#include "estimation/bounded/search/tile_division.hpp"
#include "estimation/bounded/touch_overlap.hpp"

namespace palpate {

namespace {

/// Bins that are evaluated before the total is looked at again: few at first, for the best ones
/// raise it most.
constexpr std::int64_t first_batch = 1024;
/// As many where touches are uncertain: then most work lies in the bins within reach of a batch's.
constexpr std::int64_t first_displaced = 16384;
/// Products of bins and elements, where a budget must not be overdrawn by much: a few ms.
constexpr std::int64_t budgeted_work = 5'000'000;
constexpr std::size_t leaves_per_task = 16;
constexpr double infinity = std::numeric_limits<double>::infinity();
/// Memory for leaves that are not settled.
constexpr std::size_t most_pending_bytes = std::size_t{32} << 20;
/// Part of the tolerance that rounding may use up.
constexpr double rounding_part = 0.2;
/// Products of bins and elements that are evaluated in float64 before the clock is looked at again.
constexpr double refined_together = 2e6;
/// See BoundedOptions::poor_bins.
constexpr double poor_share = 0.75;

}  // namespace

UnsettledMass unsettled(std::span<const Tile> tiles, std::size_t level, const SearchSpace& space,
                        const MassAccount& account) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const Tile& tile : tiles) {
    largest = std::max(largest, tile.bound);
  }
  UnsettledMass mass(space.bounds.size(), largest, account.slot_nats(largest));
  for (const Tile& tile : tiles) {
    mass.add(static_cast<std::size_t>(tile.object), tile.bound,
             space.bounds[tile.object].bins(level, tile));
  }
  return mass;
}

Leaves::Leaves(const SearchTask& task, MassAccount& account)
    : task_(task),
      account_(account),
      displaced_(task.likelihood.displaces()),
      probed_in_row_(task.space.bounds.size() * task.space.turns.size()),
      poor_below_(poor_share * prior_log_likelihood(task.elements, task.options.contact)),
      pending_mass_(task.space.bounds.size()) {
  for (std::size_t i = 0; i < pending_mass_.size(); ++i) {
    float32_error_.push_back(task.likelihood.float32_error(i, task.elements));
    float64_error_.push_back(task.likelihood.float64_error(i, task.elements));
  }
  least_error_ = *std::max_element(float64_error_.begin(), float64_error_.end());
}

bool Leaves::probed(const Tile& tile) const {
  return probed_in_row_[row_of(tile)] &&
         std::binary_search(probed_.begin(), probed_.end(), tile, stands_before);
}

void Leaves::remove(const Tile& tile, UnsettledMass& left) const {
  left.remove(static_cast<std::size_t>(tile.object), tile.bound, box_of(tile).bins());
}

void Leaves::probe(std::vector<Tile> tiles) {
  std::erase_if(tiles, [&](const Tile& tile) { return probed(tile); });
  std::vector<BinBox> boxes;
  for (const Tile& tile : tiles) {
    boxes.push_back(box_of(tile));
    probed_in_row_[row_of(tile)] = true;
  }
  add(std::move(boxes));
  probed_.insert(probed_.end(), tiles.begin(), tiles.end());
  std::sort(probed_.begin(), probed_.end(), stands_before);
}

std::vector<Leaves::Family> Leaves::families_of(std::span<const Tile> tiles) const {
  std::vector<Family> families;
  // Single bins lie too far apart to be evaluated together, but where touches are uncertain: those
  // between them are evaluated all the same.
  const bool alone = task_.space.bounds.front().levels().back().size.bins > 0 && !displaced_;
  const int shift = alone ? 0 : std::countr_zero(unsigned{batch_side});
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const Tile& tile = tiles[i];
    if (i == 0 || tile.object != tiles[i - 1].object || tile.theta != tiles[i - 1].theta ||
        tile.y >> shift != tiles[i - 1].y >> shift || tile.x >> shift != tiles[i - 1].x >> shift) {
      families.push_back({.first = i, .end = i, .bound = tile.bound});
    }
    Family& family = families.back();
    ++family.end;
    family.bound = std::max(family.bound, tile.bound);
  }
  return families;
}

void Leaves::take_family(std::span<const Tile> family, const std::vector<std::size_t>& from,
                         UnsettledMass& left, std::vector<BinBox>& boxes) const {
  const auto needed = [&](const Tile& tile) {
    return left.slot(tile.bound) < from[tile.object] && !probed(tile);
  };
  if (std::ranges::any_of(family, [&](const Tile& tile) { return probed(tile); })) {
    // No bin may be settled twice.
    for (const Tile& tile : family) {
      if (needed(tile)) {
        boxes.push_back(box_of(tile));
        remove(tile, left);
      }
    }
    return;
  }
  std::optional<TileRange> range;
  for (const Tile& tile : family) {
    if (needed(tile)) {
      range = range ? TileRange{.x_first = std::min(range->x_first, tile.x),
                                .x_end = std::max(range->x_end, tile.x + 1),
                                .y_first = std::min(range->y_first, tile.y),
                                .y_end = std::max(range->y_end, tile.y + 1)}
                    : TileRange{tile.x, tile.x + 1, tile.y, tile.y + 1};
    }
  }
  if (!range) {
    return;
  }
  for (const Tile& tile : family) {
    if (range->holds(tile)) {
      remove(tile, left);
    }
  }
  const Tile& first = family.front();
  boxes.push_back(
      task_.space.bounds[first.object].levels().back().box_of(first.object, first.theta, *range));
}

void Leaves::evaluate(std::span<const Tile> tiles, double tolerance) {
  if (tiles.empty()) {
    return;
  }
  UnsettledMass left = unsettled(tiles, task_.space.finest_level(), task_.space, account_);
  for (const Tile& tile : tiles) {
    if (probed(tile)) {
      remove(tile, left);
    }
  }
  std::vector<std::size_t> from = account_.droppable_from(left, tolerance);
  // Families in the order of their best tiles' slots, by counting.
  std::vector<Family> families = families_of(tiles);
  std::erase_if(families, [&](const Family& family) {
    return left.slot(family.bound) >= from[tiles[family.first].object];
  });
  std::vector<std::size_t> begins(UnsettledMass::slots + 1);
  for (const Family& family : families) {
    ++begins[left.slot(family.bound) + 1];
  }
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<Family> ordered(families.size());
  for (const Family& family : families) {
    ordered[begins[left.slot(family.bound)]++] = family;
  }
  const auto elements = static_cast<std::int64_t>(task_.elements.from_pivot_mm.size()) + 1;
  const std::int64_t most =
      task_.deadline.exists() ? std::max(first_batch, budgeted_work / elements) : largest_batch;
  std::int64_t size = displaced_ ? first_displaced : first_batch;
  for (std::size_t next = 0; next < ordered.size() && !ended();) {
    std::vector<BinBox> boxes;
    std::int64_t bins = 0;
    for (; next < ordered.size() && bins < size; ++next) {
      const Family& family = ordered[next];
      const std::size_t before = boxes.size();
      take_family(tiles.subspan(family.first, family.end - family.first), from, left, boxes);
      for (std::size_t i = before; i < boxes.size(); ++i) {
        bins += boxes[i].bins();
      }
    }
    add(std::move(boxes));
    from = account_.droppable_from(left, tolerance);
    size = std::min(2 * size, most);
    if (displaced_ && !task_.deadline.exists()) {
      // The best have told the total. Bins that lie together share all within reach of them.
      size = most;
      std::ranges::sort(ordered.begin() + static_cast<std::ptrdiff_t>(next), ordered.end(), {},
                        &Family::first);
    }
  }
  account_.drop(left);
}

void Leaves::look(const Tile& tile) {
  const BinBox box = box_of(tile);
  std::vector<double> values(static_cast<std::size_t>(box.bins()));
  task_.likelihood.evaluate(std::span(&box, 1), task_.elements, std::span(values));
  bins_ += box.bins();
  account_.raise_best(box.object, std::ranges::max(values) - float64_error_[box.object]);
}

void Leaves::add(std::vector<BinBox> boxes) {
  std::ranges::sort(boxes, {}, [](const BinBox& box) {
    return std::tie(box.object, box.theta, box.y_first, box.x_first);
  });
  if (task_.goal.counted != nullptr) {
    for (BinBox& box : boxes) {
      box = task_.goal.counted->cut(box);
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
  evaluate(added, std::span(values_));
  for (const Leaf& leaf : added) {
    const double error = float32_error_[leaf.box.object] + leaf.error;
    pending_mass_[leaf.box.object].add(task_.space.log_weight[leaf.box.object] - error +
                                       leaf.log_mass);
    account_.raise_best(leaf.box.object, leaf.least - error);
  }
  account_.raise_totals(pending_mass_);
  if (pending_.size() * sizeof(Leaf) + values_.size() * sizeof(float) > most_pending_bytes) {
    settle(0.5);
  }
}

template <typename Value>
void Leaves::evaluate(std::span<Leaf> leaves, std::span<Value> values) const {
  std::vector<BinBox> boxes;
  for (const Leaf& leaf : leaves) {
    boxes.push_back(leaf.box);
  }
  std::vector<double> errors(displaced_ ? values.size() : 0);
  task_.likelihood.evaluate_on_threads(boxes, task_.elements, values.subspan(leaves.front().first),
                                       errors);
  // An error of half a nat may be that of a likelihood of 0.
  constexpr double most_error = 0.45;
  const std::size_t first_value = leaves.front().first;
  parallel_for((leaves.size() + leaves_per_task - 1) / leaves_per_task, [&](std::size_t part) {
    const std::size_t end = std::min((part + 1) * leaves_per_task, leaves.size());
    for (std::size_t i = part * leaves_per_task; i < end; ++i) {
      Leaf& leaf = leaves[i];
      const auto own = values.subspan(leaf.first, static_cast<std::size_t>(leaf.box.bins()));
      if (task_.goal.counted != nullptr) {
        task_.goal.counted->leave_out_others(leaf.box, own.data());
      }
      leaf.largest = std::ranges::max(own);
      double sum = 0.0;
      for (const Value log_likelihood : own) {
        sum += std::exp(static_cast<double>(log_likelihood) - leaf.largest);
      }
      leaf.log_mass = leaf.largest + std::log(sum);
      leaf.least = leaf.largest;
      if (!errors.empty()) {
        double wrong = 0.0;
        double of_best = 0.0;
        const double* error = errors.data() + (leaf.first - first_value);
        for (const Value log_likelihood : own) {
          const double nats = static_cast<double>(log_likelihood);
          // Large errors are those of very small likelihoods.
          wrong += *error < 1.0 ? std::exp(nats - leaf.largest) * std::expm1(*error)
                                : std::exp(nats - leaf.largest + *error);
          of_best = nats == leaf.largest ? std::max(of_best, *error) : of_best;
          ++error;
        }
        leaf.error = std::log1p(wrong / sum);
        leaf.least = of_best < most_error ? leaf.largest - 2.0 * of_best : -infinity;
      }
    }
  });
}

std::vector<std::size_t> Leaves::to_be_refined(double share) const {
  // Leaves by their masses, in slots of 1/16 nat below the total: how much rounding each slot adds.
  constexpr std::size_t slots = 1024;
  constexpr double per_nat = 16.0;
  const std::vector<double>& log_weight = task_.space.log_weight;
  const SearchGoal& goal = task_.goal;
  const auto share_of = [&](const Leaf& leaf) {
    return std::exp(log_weight[leaf.box.object] + leaf.log_mass - account_.log_total());
  };
  const auto slot_of = [&](const Leaf& leaf) {
    const double below = account_.log_total() - log_weight[leaf.box.object] - leaf.log_mass;
    return static_cast<std::size_t>(std::clamp(below * per_nat, 0.0, slots - 1.0));
  };
  const auto may_be_best = [&](const Leaf& leaf) {
    return goal.mode &&
           log_weight[leaf.box.object] + leaf.largest + float32_error_[leaf.box.object] >=
               account_.best();
  };
  const auto needs_evidence = [&](const Leaf& leaf) {
    return goal.evidence_nats && 2.0 * std::expm1(float32_error_[leaf.box.object]) >
                                     evidence_rounding_part * *goal.evidence_nats;
  };
  std::vector<double> rounding(slots);
  for (const Leaf& leaf : pending_) {
    rounding[slot_of(leaf)] += std::expm1(float32_error_[leaf.box.object]) * share_of(leaf);
  }
  const double left_part =
      goal.tolerance * rounding_part + least_error_ - account_.rounding_share();
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

void Leaves::settle(double share) {
  const std::vector<std::size_t> refined =
      task_.goal.exact ? to_be_refined(share) : std::vector<std::size_t>();
  const std::size_t most =
      displaced_
          ? largest_batch
          : static_cast<std::size_t>(refined_together /
                                     static_cast<double>(task_.elements.from_pivot_mm.size() + 1));
  std::vector<Leaf> exact;
  std::vector<double> values;
  for (std::size_t done = 0; done < refined.size() && (done == 0 || !task_.deadline.passed());) {
    exact.clear();
    std::size_t value = 0;
    for (; done < refined.size() && (exact.empty() || value < most); ++done) {
      Leaf& leaf = pending_[refined[done]];
      exact.push_back(leaf);
      exact.back().first = value;
      value += static_cast<std::size_t>(leaf.box.bins());
      leaf.box.y_count = 0;  // settled below
    }
    values.resize(value);
    evaluate(std::span(exact), std::span(values));
    for (const Leaf& leaf : exact) {
      settle(leaf, std::span(values).subspan(leaf.first, static_cast<std::size_t>(leaf.box.bins())),
             float64_error_[leaf.box.object] + leaf.error);
    }
  }
  for (const Leaf& leaf : pending_) {
    if (const std::int64_t bins = leaf.box.bins(); bins > 0) {
      const auto from = values_.begin() + static_cast<std::ptrdiff_t>(leaf.first);
      values.assign(from, from + bins);
      settle(leaf, values, float32_error_[leaf.box.object] + leaf.error);
    }
  }
  pending_.clear();
  values_.clear();
  pending_mass_.assign(pending_mass_.size(), {});
  account_.raise_totals(pending_mass_);
}

void Leaves::settle(const Leaf& leaf, std::span<const double> values, double error) {
  account_.settle(leaf.box.object, leaf.box.bins(), leaf.log_mass, leaf.least, error);
  account_.note_best(leaf.box, std::ranges::max_element(values) - values.begin(), leaf.largest);
  task_.visit(leaf.box, values);
}

}  // namespace palpate
