#include "bound_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <tuple>

#include <tbb/parallel_for.h>

#include "hypotheses.hpp"
#include "log_sum.hpp"
#include "mass_histogram.hpp"

namespace palpate {

namespace {

constexpr double nothing = -std::numeric_limits<double>::infinity();
/// Tiles that are followed down to the bins, to know early how much mass there is at least.
constexpr std::size_t beam_tiles = 64;
/// Largest tiles that are divided together: bounds the memory for their parts.
constexpr std::size_t most_together = 8192;
/// Tiles of one theta that a task divides.
constexpr std::size_t tiles_per_task = 64;

bool before(const Tile& a, const Tile& b) {
  if (a.bound != b.bound) {
    return a.bound > b.bound;
  }
  return std::tie(a.object, a.theta, a.y, a.x) < std::tie(b.object, b.theta, b.y, b.x);
}

bool in_place(const Tile& a, const Tile& b) {
  return std::tie(a.object, a.theta, a.y, a.x) < std::tie(b.object, b.theta, b.y, b.x);
}

/// Keeps the tiles of the largest bounds.
void keep_best(std::vector<Tile>& tiles, std::size_t count) {
  if (tiles.size() > count) {
    std::nth_element(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(count), tiles.end(),
                     before);
    tiles.resize(count);
  }
}

}  // namespace

/// One run of the search.
class SearchRun {
 public:
  SearchRun(const BoundSearch& search, const KnownElements& elements, const BinVisitor& visit)
      : search_(search),
        lattice_(search.options_.lattice),
        elements_(elements),
        leaves_(search.likelihood_, search.bounds_, search.log_weight_, search.options_, elements,
                visit) {
    for (std::size_t i = 0; i < search_.bounds_.size(); ++i) {
      std::vector<double> of_level;
      for (std::size_t level = 0; level < search_.bounds_[i].levels().size(); ++level) {
        of_level.push_back(search_.log_weight_[i] + search_.bounds_[i].best(level, elements));
      }
      unpenalised_.push_back(std::move(of_level));
    }
    finest_ = search_.bounds_.front().levels().size() - 1;
  }

  SearchResult result() {
    std::vector<Tile> tiles = largest_tiles();
    double largest = nothing;
    for (const Tile& tile : tiles) {
      largest = std::max(largest, tile.bound);
    }
    {
      std::vector<Tile> beam = tiles;
      keep_best(beam, beam_tiles);
      descend_beam(std::move(beam), 0);
    }
    divide(std::move(tiles), 0, search_.options_.tolerance * search_share);
    SearchResult result = leaves_.result();
    result.blocks_bounded = blocks_;
    return result;
  }

 private:
  /// Part of the tolerance that dropped tiles may use up; the rest is for rounding.
  static constexpr double search_share = 0.75;

  std::vector<Tile> largest_tiles() {
    const auto thetas = static_cast<std::size_t>(lattice_.theta_rad.count);
    const std::size_t objects = search_.bounds_.size();
    std::vector<std::vector<Tile>> of_theta(objects * thetas);
    tbb::parallel_for(std::size_t{0}, of_theta.size(), [&](std::size_t row) {
      const std::size_t object = row / thetas;
      const std::size_t theta = row % thetas;
      const TileLevel& level = search_.bounds_[object].levels().front();
      const std::size_t batches = static_cast<std::size_t>(level.batches_x()) * level.batches_y();
      const std::uint32_t* sums =
          search_.largest_tiles_[object].data() + theta * batches * batch_tiles;
      std::vector<Tile>& tiles = of_theta[row];
      for (int by = 0; by < level.batches_y(); ++by) {
        for (int bx = 0; bx < level.batches_x(); ++bx, sums += batch_tiles) {
          append_batch(object, static_cast<std::int32_t>(theta), 0, bx * batch_side,
                       by * batch_side, sums, tiles);
        }
      }
    });
    std::vector<Tile> tiles;
    for (const std::vector<Tile>& part : of_theta) {
      tiles.insert(tiles.end(), part.begin(), part.end());
    }
    blocks_ += static_cast<std::int64_t>(tiles.size());
    return tiles;
  }

  /// Appends the tiles of a batch that hold bins.
  void append_batch(std::size_t object, std::int32_t theta, std::size_t level, int first_x,
                    int first_y, const std::uint32_t* sums, std::vector<Tile>& tiles) const {
    const TileLevel& of = search_.bounds_[object].levels()[level];
    for (int j = 0; j < batch_side; ++j) {
      if (of.y.bins(first_y + j) == 0) {
        continue;
      }
      for (int i = 0; i < batch_side; ++i) {
        if (of.x.bins(first_x + i) > 0) {
          tiles.push_back(
              {.bound = unpenalised_[object][level] - sums[batch_side * i + j] / penalties_per_nat,
               .object = static_cast<std::int32_t>(object),
               .theta = theta,
               .x = first_x + i,
               .y = first_y + j});
        }
      }
    }
  }

  /// The parts, one level down, of tiles that are sorted by place.
  std::vector<Tile> parts_of(std::span<const Tile> tiles, std::size_t level) {
    std::vector<std::size_t> begins;  // of tasks: tiles of one object and theta
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (i == 0 || tiles[i].object != tiles[i - 1].object ||
          tiles[i].theta != tiles[i - 1].theta || i - begins.back() == tiles_per_task) {
        begins.push_back(i);
      }
    }
    std::vector<std::vector<Tile>> parts(begins.size());
    tbb::parallel_for(std::size_t{0}, begins.size(), [&](std::size_t task) {
      thread_local PlacedElements placed;
      const std::size_t end = task + 1 < begins.size() ? begins[task + 1] : tiles.size();
      const Tile& first = tiles[begins[task]];
      const TileBounds& bounds = search_.bounds_[first.object];
      bounds.place(level + 1, lattice_.theta_rad.centre(first.theta), elements_, placed);
      parts[task].reserve((end - begins[task]) * batch_tiles);
      for (std::size_t i = begins[task]; i < end; ++i) {
        std::uint32_t sums[batch_tiles] = {};
        const int x = tiles[i].x * batch_side;
        const int y = tiles[i].y * batch_side;
        bounds.add(level + 1, elements_, placed, x, y, sums);
        append_batch(static_cast<std::size_t>(first.object), first.theta, level + 1, x, y, sums,
                     parts[task]);
      }
    });
    std::vector<Tile> all;
    std::size_t count = 0;
    for (const std::vector<Tile>& part : parts) {
      count += part.size();
    }
    all.reserve(count);
    for (const std::vector<Tile>& part : parts) {
      all.insert(all.end(), part.begin(), part.end());
    }
    blocks_ += static_cast<std::int64_t>(all.size());
    return all;
  }

  /// Follows the best tiles down to their bins.
  void descend_beam(std::vector<Tile> tiles, std::size_t level) {
    for (; level < finest_; ++level) {
      std::sort(tiles.begin(), tiles.end(), in_place);
      tiles = parts_of(tiles, level);
      keep_best(tiles, beam_tiles);
    }
    leaves_.probe(std::move(tiles));
  }

  /// Drops what may be dropped of the tiles, and divides the rest.
  /// @param tolerance part of the total that may be dropped
  void divide(std::vector<Tile> tiles, std::size_t level, double tolerance) {
    if (level == finest_) {
      leaves_.evaluate(std::move(tiles), tolerance);
      return;
    }
    const double share = tolerance / static_cast<double>(finest_ - level + 1);
    const double used = drop(tiles, level, share);
    tolerance -= used;
    if (tiles.size() <= most_together) {
      std::sort(tiles.begin(), tiles.end(), in_place);
      std::vector<Tile> parts = parts_of(tiles, level);
      if (level + 1 < finest_) {
        std::vector<Tile> beam = parts;
        keep_best(beam, beam_tiles);
        descend_beam(std::move(beam), level + 1);
      }
      divide(std::move(parts), level + 1, tolerance);
      return;
    }
    std::sort(tiles.begin(), tiles.end(), before);
    while (!tiles.empty()) {
      const std::size_t chunks = (tiles.size() + most_together - 1) / most_together;
      std::vector<Tile> chunk(tiles.begin(), tiles.begin() + std::min(most_together, tiles.size()));
      tiles.erase(tiles.begin(), tiles.begin() + static_cast<std::ptrdiff_t>(chunk.size()));
      std::sort(chunk.begin(), chunk.end(), in_place);
      const double of_chunk = tolerance / static_cast<double>(chunks);
      const double before_chunk = leaves_.dropped_share();
      divide(parts_of(chunk, level), level + 1, of_chunk);
      tolerance -= std::max(0.0, leaves_.dropped_share() - before_chunk);
      tolerance = std::max(tolerance, 0.0);
      tolerance -= drop(tiles, level, tolerance / 2.0);
    }
  }

  /// Drops the tiles of the least bounds that hold at most this part of the total.
  /// @returns the part that was dropped
  double drop(std::vector<Tile>& tiles, std::size_t level, double share) {
    double largest = nothing;
    for (const Tile& tile : tiles) {
      largest = std::max(largest, tile.bound);
    }
    const auto histogram = std::make_unique<MassHistogram>(largest);
    for (const Tile& tile : tiles) {
      histogram->add(tile.bound, search_.bounds_[tile.object].bins(level, tile));
    }
    std::size_t from = histogram->droppable_from(std::log(share) + leaves_.log_total());
    from = std::max(from, histogram->slot(leaves_.best()) + 1);  // the mode must not be lost
    const double before_drop = leaves_.dropped_share();
    std::erase_if(tiles, [&](const Tile& tile) {
      const bool drops = histogram->slot(tile.bound) >= from;
      if (drops) {
        leaves_.drop(tile, search_.bounds_[tile.object].bins(level, tile));
      }
      return drops;
    });
    return std::max(0.0, leaves_.dropped_share() - before_drop);
  }

  const BoundSearch& search_;
  const PoseLattice& lattice_;
  const KnownElements& elements_;
  std::vector<std::vector<double>> unpenalised_;  ///< [object][level], with the prior weight
  std::size_t finest_ = 0;
  LeafPass leaves_;
  std::int64_t blocks_ = 0;
};

BoundSearch::BoundSearch(std::span<const Hypothesis> hypotheses, const BoundedOptions& options,
                         const BinLikelihood& likelihood)
    : options_(options), likelihood_(likelihood), log_weight_(log_weights(hypotheses)) {
  std::vector<std::optional<TileBounds>> bounds(hypotheses.size());
  tbb::parallel_for(std::size_t{0}, hypotheses.size(), [&](std::size_t i) {
    bounds[i].emplace(hypotheses[i].map, options.contact, i, options.lattice);
  });
  for (std::optional<TileBounds>& of : bounds) {
    const TileLevel& level = of->levels().front();
    largest_tiles_.emplace_back(static_cast<std::size_t>(options.lattice.theta_rad.count) *
                                level.batches_x() * level.batches_y() * batch_tiles);
    bounds_.push_back(*std::move(of));
  }
}

void BoundSearch::reset() {
  for (std::vector<std::uint32_t>& sums : largest_tiles_) {
    std::fill(sums.begin(), sums.end(), 0);
  }
}

void BoundSearch::add(const KnownElements& added) {
  const auto thetas = static_cast<std::size_t>(options_.lattice.theta_rad.count);
  tbb::parallel_for(std::size_t{0}, bounds_.size() * thetas, [&](std::size_t row) {
    thread_local PlacedElements placed;
    const std::size_t object = row / thetas;
    const std::size_t theta = row % thetas;
    const TileBounds& bounds = bounds_[object];
    const TileLevel& level = bounds.levels().front();
    bounds.place(0, options_.lattice.theta_rad.centre(static_cast<int>(theta)), added, placed);
    std::uint32_t* sums =
        largest_tiles_[object].data() +
        theta * static_cast<std::size_t>(level.batches_x()) * level.batches_y() * batch_tiles;
    for (int by = 0; by < level.batches_y(); ++by) {
      for (int bx = 0; bx < level.batches_x(); ++bx, sums += batch_tiles) {
        bounds.add(0, added, placed, bx * batch_side, by * batch_side, sums);
      }
    }
  });
}

SearchResult BoundSearch::run(const KnownElements& elements, const BinVisitor& visit) const {
  return SearchRun(*this, elements, visit).result();
}

std::uint64_t BoundSearch::bytes() const {
  std::uint64_t bytes = 0;
  for (const TileBounds& bounds : bounds_) {
    bytes += bounds.bytes();
  }
  for (const std::vector<std::uint32_t>& sums : largest_tiles_) {
    bytes += sums.capacity() * sizeof(std::uint32_t);
  }
  return bytes;
}

}  // namespace palpate
