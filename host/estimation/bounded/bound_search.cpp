#include "bound_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include <tbb/parallel_for.h>

#include "hypotheses.hpp"
#include "seen_window.hpp"

namespace palpate {

namespace {

/// Batches of the largest tiles at one theta that make a region small.
constexpr int few_batches = 16;

}  // namespace

BoundSearch::BoundSearch(std::span<const Hypothesis> hypotheses, const BoundedOptions& options,
                         const BinLikelihood& likelihood, FasterBinLikelihood& batches)
    : options_(options),
      likelihood_(likelihood),
      batches_(batches),
      log_weight_(log_weights(hypotheses)) {
  for (int theta = 0; theta < options.lattice.theta_rad.count; ++theta) {
    const double theta_rad = options.lattice.theta_rad.centre(theta);
    turns_.emplace_back(std::cos(theta_rad), std::sin(theta_rad));
  }
  double least_cell_mm = std::numeric_limits<double>::infinity();
  for (const Hypothesis& hypothesis : hypotheses) {
    least_cell_mm = std::min(least_cell_mm, hypothesis.compared().cell_mm);
  }
  const std::vector<TileSize> sizes = tile_sizes(options.lattice, least_cell_mm, hypotheses.size());
  unseen_.resize(hypotheses.size());
  std::map<std::string, std::size_t> labels;
  for (const Hypothesis& hypothesis : hypotheses) {
    label_of_.push_back(labels.try_emplace(hypothesis.map.label, labels.size()).first->second);
  }
  std::vector<std::optional<TileBounds>> bounds(hypotheses.size());
  tbb::parallel_for(std::size_t{0}, hypotheses.size(), [&](std::size_t i) {
    bounds[i].emplace(hypotheses[i].compared(), options.contact, i, options.lattice, sizes);
  });
  for (std::optional<TileBounds>& of : bounds) {
    const TileLevel& level = of->levels().front();
    largest_tiles_.emplace_back(static_cast<std::size_t>(options.lattice.theta_rad.count) *
                                level.batches_x() * level.batches_y() * batch_tiles);
    bounds_.push_back(*std::move(of));
  }
  for (const Hypothesis& hypothesis : hypotheses) {
    OccupancyGrid shape = hypothesis.compared();
    shape.log_odds = {};
    maps_.push_back(std::move(shape));
  }
}

void BoundSearch::reset() {
  for (std::vector<std::int32_t>& sums : largest_tiles_) {
    std::fill(sums.begin(), sums.end(), 0);
  }
  std::fill(unseen_.begin(), unseen_.end(), 0);
}

void BoundSearch::add(std::span<const KnownElements> touches) {
  const TileLevel& level = bounds_.front().levels().front();
  // A single touch sees little of a large region; in a small one, fewer rounds are faster.
  if (level.batches_x() * level.batches_y() > few_batches) {
    for (const KnownElements& touch : touches) {
      add(touch);
    }
    return;
  }
  add(merged(touches));
}

void BoundSearch::add(const KnownElements& added) {
  // Most tiles of a large region do not see the map: sums count from what such a tile would have.
  std::vector<std::int64_t> offsets;
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    offsets.push_back(
        std::min<std::int64_t>(bounds_[i].penalty_beyond(0, added), largest_sum - unseen_[i]));
  }
  const auto thetas = static_cast<std::size_t>(options_.lattice.theta_rad.count);
  tbb::parallel_for(std::size_t{0}, bounds_.size() * thetas, [&](std::size_t row) {
    thread_local WindowPlaces placed;
    const std::size_t object = row / thetas;
    const std::size_t theta = row % thetas;
    const TileBounds& bounds = bounds_[object];
    const TileLevel& level = bounds.levels().front();
    const TileWindow seen = seen_window(added, turns_[theta], maps_[object], level);
    bounds.place(0, turns_[theta], added, placed);
    std::int32_t* tiles =
        largest_tiles_[object].data() +
        theta * static_cast<std::size_t>(level.batches_x()) * level.batches_y() * batch_tiles;
    for (int y = seen.y_first / batch_side * batch_side; y < seen.y_end; y += batch_side) {
      for (int x = seen.x_first / batch_side * batch_side; x < seen.x_end; x += batch_side) {
        std::uint32_t sums[batch_tiles] = {};
        bounds.add(0, added, placed, x, y, sums);
        std::int32_t* of_batch =
            tiles + (static_cast<std::size_t>(y / batch_side) * level.batches_x() +
                     static_cast<std::size_t>(x / batch_side)) *
                        batch_tiles;
        for (int i = 0; i < batch_tiles; ++i) {
          const std::int64_t sum = std::int64_t{of_batch[i]} + sums[i] - offsets[object];
          of_batch[i] = static_cast<std::int32_t>(std::min<std::int64_t>(sum, largest_sum));
        }
      }
    }
  });
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    unseen_[i] += offsets[i];
  }
}

std::uint64_t BoundSearch::bytes() const {
  std::uint64_t bytes = 0;
  for (const TileBounds& bounds : bounds_) {
    bytes += bounds.bytes();
  }
  for (const std::vector<std::int32_t>& sums : largest_tiles_) {
    bytes += sums.capacity() * sizeof(std::int32_t);
  }
  return bytes;
}

}  // namespace palpate
