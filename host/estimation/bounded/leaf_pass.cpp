#include "leaf_pass.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

namespace palpate {

namespace {

/// Leaves that are evaluated before the total is looked at again: few at first, for the best ones
/// raise it most.
constexpr std::size_t first_batch = 512;
constexpr std::size_t largest_batch = 8192;
/// Neighbouring tiles in a row are evaluated as one box up to so many bins: fuller vectors.
constexpr std::int64_t most_joined_bins = 16;

}  // namespace

bool stands_before(const Tile& a, const Tile& b) {
  return std::tie(a.object, a.theta, a.y, a.x) < std::tie(b.object, b.theta, b.y, b.x);
}

UnsettledMass unsettled(std::span<const Tile> tiles, std::size_t level,
                        std::span<const TileBounds> bounds) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const Tile& tile : tiles) {
    largest = std::max(largest, tile.bound);
  }
  UnsettledMass mass(bounds.size(), largest);
  for (const Tile& tile : tiles) {
    mass.add(static_cast<std::size_t>(tile.object), tile.bound,
             bounds[tile.object].bins(level, tile));
  }
  return mass;
}

LeafPass::LeafPass(std::span<const TileBounds> bounds, std::size_t thetas, const Deadline& deadline,
                   MassAccount& account, LeafEvaluator& evaluator)
    : bounds_(bounds),
      thetas_(thetas),
      deadline_(deadline),
      account_(account),
      evaluator_(evaluator),
      probed_in_row_(bounds.size() * thetas) {}

bool LeafPass::probed(const Tile& tile) const {
  return probed_in_row_[static_cast<std::size_t>(tile.object) * thetas_ + tile.theta] &&
         std::binary_search(probed_.begin(), probed_.end(), tile, stands_before);
}

void LeafPass::evaluate_batch(std::span<const Tile> tiles) {
  std::vector<BinBox> boxes;
  boxes.reserve(tiles.size());
  for (const Tile& tile : tiles) {
    boxes.push_back(bounds_[tile.object].levels().back().box_of(tile));
  }
  std::sort(boxes.begin(), boxes.end(), [](const BinBox& a, const BinBox& b) {
    return std::tie(a.object, a.theta, a.y_first, a.x_first) <
           std::tie(b.object, b.theta, b.y_first, b.x_first);
  });
  std::size_t last = 0;
  for (std::size_t i = 1; i < boxes.size(); ++i) {
    BinBox& a = boxes[last];
    const BinBox& b = boxes[i];
    if (a.object == b.object && a.theta == b.theta && a.y_first == b.y_first &&
        a.y_count == b.y_count && a.x_first + a.x_count == b.x_first &&
        a.bins() + b.bins() <= most_joined_bins) {
      a.x_count += b.x_count;
    } else {
      boxes[++last] = b;
    }
  }
  boxes.resize(std::min(boxes.size(), last + 1));
  evaluator_.add(boxes);
}

void LeafPass::probe(std::vector<Tile> tiles) {
  std::erase_if(tiles, [&](const Tile& tile) { return probed(tile); });
  evaluate_batch(tiles);
  for (const Tile& tile : tiles) {
    probed_in_row_[static_cast<std::size_t>(tile.object) * thetas_ + tile.theta] = true;
  }
  probed_.insert(probed_.end(), tiles.begin(), tiles.end());
  std::sort(probed_.begin(), probed_.end(), stands_before);
}

void LeafPass::evaluate(std::span<const Tile> tiles, double tolerance) {
  if (tiles.empty()) {
    return;
  }
  const std::size_t finest = bounds_.front().levels().size() - 1;
  const auto remove = [&](const Tile& tile, UnsettledMass& mass) {
    mass.remove(static_cast<std::size_t>(tile.object), tile.bound,
                bounds_[tile.object].bins(finest, tile));
  };
  UnsettledMass left = unsettled(tiles, finest, bounds_);
  if (!probed_.empty()) {
    for (const Tile& tile : tiles) {
      if (probed(tile)) {
        remove(tile, left);
      }
    }
  }
  std::vector<std::size_t> from = account_.droppable_from(left, tolerance);
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
  for (std::size_t next = 0; next < ordered.size() && !deadline_.passed();) {
    batch.clear();
    for (; next < ordered.size() && batch.size() < size; ++next) {
      const Tile& tile = ordered[next];
      if (left.slot(tile.bound) < from[tile.object] && !probed(tile)) {
        batch.push_back(tile);
        remove(tile, left);
      }
    }
    evaluate_batch(batch);
    from = account_.droppable_from(left, tolerance);
    size = std::min(2 * size, largest_batch);
  }
  account_.drop(left);
}

}  // namespace palpate
