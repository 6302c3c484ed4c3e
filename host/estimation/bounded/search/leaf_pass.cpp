#include "estimation/bounded/search/leaf_pass.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace palpate {

namespace {

/// Bins that are evaluated before the total is looked at again: few at first, for the best ones
/// raise it most.
constexpr std::int64_t first_batch = 1024;
/// Products of bins and elements, where a budget must not be overdrawn by much: a few ms.
constexpr std::int64_t budgeted_work = 5'000'000;

}  // namespace

bool stands_before(const Tile& a, const Tile& b) {
  return std::tie(a.object, a.theta, a.y, a.x) < std::tie(b.object, b.theta, b.y, b.x);
}

UnsettledMass unsettled(std::span<const Tile> tiles, std::size_t level,
                        std::span<const TileBounds> bounds, const MassAccount& account) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const Tile& tile : tiles) {
    largest = std::max(largest, tile.bound);
  }
  UnsettledMass mass(bounds.size(), largest, account.slot_nats(largest));
  for (const Tile& tile : tiles) {
    mass.add(static_cast<std::size_t>(tile.object), tile.bound,
             bounds[tile.object].bins(level, tile));
  }
  return mass;
}

LeafPass::LeafPass(std::span<const TileBounds> bounds, std::size_t thetas, std::size_t elements,
                   const Deadline& deadline, MassAccount& account, LeafEvaluator& evaluator)
    : bounds_(bounds),
      thetas_(thetas),
      elements_(static_cast<std::int64_t>(elements) + 1),
      deadline_(deadline),
      account_(account),
      evaluator_(evaluator),
      probed_in_row_(bounds.size() * thetas) {}

bool LeafPass::probed(const Tile& tile) const {
  return probed_in_row_[static_cast<std::size_t>(tile.object) * thetas_ + tile.theta] &&
         std::binary_search(probed_.begin(), probed_.end(), tile, stands_before);
}

void LeafPass::evaluate_boxes(std::vector<BinBox> boxes) {
  std::sort(boxes.begin(), boxes.end(), [](const BinBox& a, const BinBox& b) {
    return std::tie(a.object, a.theta, a.y_first, a.x_first) <
           std::tie(b.object, b.theta, b.y_first, b.x_first);
  });
  evaluator_.add(std::move(boxes));
}

std::vector<BinBox> LeafPass::boxes_of(std::span<const Tile> tiles) const {
  std::vector<BinBox> boxes;
  boxes.reserve(tiles.size());
  for (const Tile& tile : tiles) {
    boxes.push_back(bounds_[tile.object].levels().back().box_of(tile));
  }
  return boxes;
}

void LeafPass::probe(std::vector<Tile> tiles) {
  std::erase_if(tiles, [&](const Tile& tile) { return probed(tile); });
  evaluate_boxes(boxes_of(tiles));
  for (const Tile& tile : tiles) {
    probed_in_row_[static_cast<std::size_t>(tile.object) * thetas_ + tile.theta] = true;
  }
  probed_.insert(probed_.end(), tiles.begin(), tiles.end());
  std::sort(probed_.begin(), probed_.end(), stands_before);
}

std::vector<LeafPass::Family> LeafPass::families_of(std::span<const Tile> tiles) const {
  std::vector<Family> families;
  // Single bins lie too far apart to be evaluated together.
  const int shift =
      bounds_.front().levels().back().size.single_bin ? 0 : std::countr_zero(unsigned{batch_side});
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

void LeafPass::take_family(std::span<const Tile> family, const std::vector<std::size_t>& from,
                           UnsettledMass& left, std::vector<BinBox>& boxes) const {
  const TileLevel& level = bounds_[family.front().object].levels().back();
  const auto needed = [&](const Tile& tile) {
    return left.slot(tile.bound) < from[tile.object] && !probed(tile);
  };
  if (std::any_of(family.begin(), family.end(), [&](const Tile& tile) { return probed(tile); })) {
    // No bin may be settled twice.
    for (const Tile& tile : family) {
      if (needed(tile)) {
        boxes.push_back(level.box_of(tile));
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
  boxes.push_back(level.box_of(family.front().object, family.front().theta, *range));
}

void LeafPass::remove(const Tile& tile, UnsettledMass& left) const {
  left.remove(static_cast<std::size_t>(tile.object), tile.bound,
              bounds_[tile.object].bins(bounds_[tile.object].levels().size() - 1, tile));
}

void LeafPass::evaluate(std::span<const Tile> tiles, double tolerance) {
  if (tiles.empty()) {
    return;
  }
  UnsettledMass left = unsettled(tiles, bounds_.front().levels().size() - 1, bounds_, account_);
  for (const Tile& tile : tiles) {
    if (probed(tile)) {
      remove(tile, left);
    }
  }
  std::vector<std::size_t> from = account_.droppable_from(left, tolerance);
  // Families in the order of their best tiles' slots, by counting.
  const std::vector<Family> families = families_of(tiles);
  const auto needed = [&](const Family& family) {
    return left.slot(family.bound) < from[tiles[family.first].object];
  };
  std::vector<std::size_t> begins(UnsettledMass::slots + 1);
  for (const Family& family : families) {
    if (needed(family)) {
      ++begins[left.slot(family.bound) + 1];
    }
  }
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  std::vector<Family> ordered(begins.back());
  for (const Family& family : families) {
    if (needed(family)) {
      ordered[begins[left.slot(family.bound)]++] = family;
    }
  }
  const std::int64_t most =
      deadline_.exists() ? std::max(first_batch, budgeted_work / elements_) : largest_batch;
  std::int64_t size = first_batch;
  for (std::size_t next = 0; next < ordered.size() && !deadline_.passed();) {
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
    evaluate_boxes(std::move(boxes));
    from = account_.droppable_from(left, tolerance);
    size = std::min(2 * size, most);
  }
  account_.drop(left);
}

}  // namespace palpate
