#include "estimation/bounded/search/leaves.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include "estimation/bounded/search/tile_division.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

/// Bins that are evaluated before the total is looked at again: few at first, for the best ones
/// raise it most.
constexpr std::size_t first_batch = 1024;
/// As many where touches are displaced: then most work lies in the bins within reach of a batch's.
constexpr std::size_t first_displaced = 16384;
/// Products of bins and elements, where a budget must not be overdrawn by much: a few ms.
constexpr std::size_t budgeted_work = 5'000'000;
constexpr std::size_t leaves_per_task = 16;
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
      displaced_(task.space.displacement.has_value()),
      poor_below_(poor_share * prior_log_likelihood(task.elements, task.options.contact)) {}

std::vector<BinBox> Leaves::boxes_of(std::span<const Tile> tiles) const {
  std::vector<BinBox> boxes;
  for (const Tile& tile : tiles) {
    boxes.push_back(level_of(tile).box_of(tile));
  }
  return boxes;
}

bool Leaves::probed(const Tile& tile) const {
  return std::ranges::binary_search(probed_, tile, stands_before);
}

void Leaves::probe(std::vector<Tile> tiles) {
  std::erase_if(tiles, [&](const Tile& tile) { return probed(tile); });
  add(boxes_of(tiles));
  probed_.insert(probed_.end(), tiles.begin(), tiles.end());
  std::ranges::sort(probed_, stands_before);
}

void Leaves::look(std::span<const Tile> tiles) {
  for (const Leaf& leaf : evaluated(boxes_of(tiles))) {
    bins_ += leaf.box.bins();
    account_.raise_best(leaf.box.object, leaf.largest - task_.error[leaf.box.object]);
  }
}

std::vector<Leaves::Family> Leaves::families_of(std::span<const Tile> tiles,
                                                UnsettledMass& left) const {
  std::vector<Family> families;
  // Tiles of one bin lie too far apart to be evaluated together, but where touches are displaced:
  // the bins between them are evaluated all the same.
  const bool single_bins = task_.space.bounds.front().levels().back().size.bins > 0 && !displaced_;
  const int shift = single_bins ? 0 : std::countr_zero(unsigned{batch_side});
  const auto parent = [&](const Tile& tile) {
    return std::tuple(tile.object, tile.theta, tile.y >> shift, tile.x >> shift);
  };
  for (std::size_t first = 0, end = 0; first < tiles.size(); first = end) {
    Family& family = families.emplace_back();
    for (; end < tiles.size() && parent(tiles[end]) == parent(tiles[first]); ++end) {
      family.slot = std::min(family.slot, left.slot(tiles[end].bound));
      if (probed(tiles[end])) {
        family.probed = true;
        remove(tiles[end], left);
      }
    }
    family.tiles = tiles.subspan(first, end - first);
  }
  return families;
}

void Leaves::take(const Family& family, std::span<const std::size_t> from, UnsettledMass& left,
                  std::vector<BinBox>& boxes) const {
  const Tile& first = family.tiles.front();
  std::optional<TileRange> range;
  for (const Tile& tile : family.tiles) {
    if (left.slot(tile.bound) >= from[tile.object]) {
      continue;
    }
    if (!family.probed) {
      range = range ? TileRange{.x_first = std::min(range->x_first, tile.x),
                                .x_end = std::max(range->x_end, tile.x + 1),
                                .y_first = std::min(range->y_first, tile.y),
                                .y_end = std::max(range->y_end, tile.y + 1)}
                    : TileRange{tile.x, tile.x + 1, tile.y, tile.y + 1};
    } else if (!probed(tile)) {
      // No bin may be settled twice.
      boxes.push_back(level_of(tile).box_of(tile));
      remove(tile, left);
    }
  }
  if (range) {
    for (const Tile& tile : family.tiles) {
      if (range->holds(tile)) {
        remove(tile, left);
      }
    }
    boxes.push_back(level_of(first).box_of(first.object, first.theta, *range));
  }
}

void Leaves::evaluate(std::span<const Tile> tiles, double tolerance) {
  if (tiles.empty()) {
    return;
  }
  UnsettledMass left = unsettled(tiles, task_.space.finest_level(), task_.space, account_);
  std::vector<Family> families = families_of(tiles, left);
  std::vector<std::size_t> from = account_.droppable_from(left, tolerance);
  std::erase_if(families, [&](const Family& family) {
    return family.slot >= from[family.tiles.front().object];
  });
  std::ranges::stable_sort(families, {}, &Family::slot);
  const std::size_t elements = task_.elements.from_pivot_mm.size() + 1;
  const std::size_t limit =
      task_.deadline.exists() ? std::max(first_batch, budgeted_work / elements) : largest_batch;
  std::size_t size = displaced_ ? first_displaced : first_batch;
  for (std::size_t next = 0; next < families.size() && !ended();) {
    std::vector<BinBox> boxes;
    for (std::size_t bins = 0; next < families.size() && bins < size; ++next) {
      const std::size_t before = boxes.size();
      take(families[next], from, left, boxes);
      bins += bins_in(std::span(boxes).subspan(before));
    }
    add(std::move(boxes));
    from = account_.droppable_from(left, tolerance);
    size = std::min(2 * size, limit);
    if (displaced_ && !task_.deadline.exists()) {
      // The best have told the total. Bins that lie together share all within reach of them.
      size = limit;
      std::ranges::sort(families.begin() + static_cast<std::ptrdiff_t>(next), families.end(), {},
                        [](const Family& family) { return family.tiles.data(); });
    }
  }
  account_.drop(left);
}

std::vector<Leaves::Leaf> Leaves::evaluated(std::vector<BinBox> boxes) {
  std::ranges::sort(boxes, {}, [](const BinBox& box) {
    return std::tie(box.object, box.theta, box.y_first, box.x_first);
  });
  std::vector<std::size_t> first;  // [box] of its values
  std::size_t bins = 0;
  for (const BinBox& box : boxes) {
    first.push_back(bins);
    bins += static_cast<std::size_t>(box.bins());
  }
  values_.resize(bins);
  task_.likelihood.evaluate(boxes, task_.elements, values_);
  std::vector<Leaf> leaves(boxes.size());
  parallel_for((leaves.size() + leaves_per_task - 1) / leaves_per_task, [&](std::size_t part) {
    const std::size_t last = std::min((part + 1) * leaves_per_task, leaves.size());
    for (std::size_t i = part * leaves_per_task; i < last; ++i) {
      const auto count = static_cast<std::size_t>(boxes[i].bins());
      const auto values = std::span(values_).subspan(first[i], count);
      const double largest = std::ranges::max(values);
      double sum = 0.0;
      for (const double nats : values) {
        sum += std::exp(nats - largest);
      }
      leaves[i] = {boxes[i], values, largest + std::log(sum), largest};
    }
  });
  return leaves;
}

void Leaves::add(std::vector<BinBox> boxes) {
  for (const Leaf& leaf : evaluated(std::move(boxes))) {
    const BinBox& box = leaf.box;
    bins_ += box.bins();
    account_.settle(box.object, box.bins(), leaf.log_mass, leaf.largest, task_.error[box.object]);
    account_.note_best(box, std::ranges::max_element(leaf.values) - leaf.values.begin(),
                       leaf.largest);
    task_.visit(box, leaf.values);
  }
  account_.raise_totals();
}

}  // namespace palpate
