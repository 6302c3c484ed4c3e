#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimation/bounded/moving/moving_object.hpp"
#include "estimation/bounded/search/displaced_tiles.hpp"
#include "estimation/log_sum.hpp"
#include "estimation/parallel_for.hpp"

// The tiles of an object that slips: their upper bounds, and which of them are followed.

namespace palpate {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int side = MovingObject::tile_bins;

}  // namespace

TileBeliefs MovingObject::tile_beliefs(const KnownElements& touch, bool slips, bool known) const {
  const std::vector<double> of_touch =
      touch.runs.empty() ? std::vector<double>(followed_.size()) : touch_bounds(touch);
  const auto slipped = [&](const std::vector<double>& logs) {
    return slips && *std::ranges::max_element(logs) > -infinity ? of_tiles_.bounds(logs) : logs;
  };
  const auto touched = [&](std::vector<double> logs) {
    for (std::size_t tile = 0; tile < logs.size(); ++tile) {
      logs[tile] += of_touch[tile] + log_bins_of(tile);
    }
    return logs;
  };
  TileBeliefs tiles{.bound = touched(slipped(largest_of_tiles(false))), .scale = scale()};
  if (known) {
    std::vector<double> held = largest_of_tiles(true);
    tiles.known = touched(slipped(held));
    tiles.held = touched(std::move(held));
  }
  return tiles;
}

std::vector<double> MovingObject::largest_of_tiles(bool known) const {
  const PoseLattice& lattice = task_.lattice;
  std::vector<double> largest(followed_.size());
  parallel_for(static_cast<std::size_t>(lattice.theta_rad.count), [&](std::size_t theta) {
    std::vector<double> mass(columns_);
    std::vector<double> rest(columns_);
    for (int row = 0; row < rows_; ++row) {
      std::ranges::fill(mass, -infinity);
      std::ranges::fill(rest, -infinity);
      for (int y = side * row; y < std::min(side * (row + 1), lattice.y_mm.count); ++y) {
        const std::size_t bin =
            (theta * lattice.y_mm.count + y) * static_cast<std::size_t>(lattice.x_mm.count);
        for (int x = 0; x < lattice.x_mm.count; ++x) {
          mass[x / side] = std::max(mass[x / side], log_mass_[bin + x]);
          rest[x / side] = std::max(rest[x / side], log_rest_[bin + x]);
        }
      }
      for (int x = 0; x < columns_; ++x) {
        const double most = mass[x] + rounding_;
        largest[(theta * rows_ + row) * columns_ + x] =
            known ? most : log_add(most, rest[x]) + 1e-12;
      }
    }
  });
  return largest;
}

std::vector<double> MovingObject::touch_bounds(const KnownElements& touch) const {
  std::vector<double> logs(followed_.size());
  const TileBounds& bounds = task_.space.bounds[object_];
  const TileLevel& tiling = bounds.levels().front();
  const double best = bounds.best(0, touch);
  const auto thetas = static_cast<std::size_t>(task_.lattice.theta_rad.count);
  std::vector<BlockRun> batches;
  for (std::size_t theta = 0; theta < thetas; ++theta) {
    for (int y = 0; y < tiling.batches_y(); ++y) {
      batches.push_back({static_cast<int>(theta), y, 0, tiling.batches_x()});
    }
  }
  const auto of_theta = static_cast<std::size_t>(tiling.batches_y());
  std::vector<std::int32_t> displaced;
  PlaceSource<float> exact;
  if (touch.touches.empty()) {
    exact = exact_penalties(task_.space, object_, 0, touch);
  } else {
    displaced = displaced_penalties(task_.space, object_, 0, touch.touches.front(), batches);
  }
  parallel_for(thetas, [&](std::size_t theta) {
    const int width = tiling.x.tiles();
    std::vector<float> nats(static_cast<std::size_t>(width) * tiling.y.tiles());
    if (touch.touches.empty()) {
      exact(std::span(batches).subspan(theta * of_theta, of_theta), {nats.data(), width, 0, 0});
    } else {
      const std::int32_t* penalty = displaced.data() + theta * nats.size();
      for (int y = 0; y < tiling.y.tiles(); y += side) {
        for (int x = 0; x < width; x += side) {
          for (int i = 0; i < side; ++i) {
            for (int j = 0; j < side; ++j) {
              nats[std::ptrdiff_t{y + j} * width + x + i] =
                  static_cast<float>(*penalty++ * (-1.0 / penalties_per_nat) + 1e-3);
            }
          }
        }
      }
    }
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        logs[(theta * rows_ + y) * columns_ + x] =
            best + nats[static_cast<std::size_t>(y) * width + x];
      }
    }
  });
  return logs;
}

std::size_t MovingObject::tile_of(std::int64_t bin) const {
  const PoseLattice& lattice = task_.lattice;
  const std::int64_t theta = bin / lattice.plane();
  const std::int64_t y = bin % lattice.plane() / lattice.x_mm.count;
  const std::int64_t x = bin % lattice.x_mm.count;
  return static_cast<std::size_t>((theta * rows_ + y / side) * columns_ + x / side);
}

std::vector<BlockRun> MovingObject::runs_of(std::span<const std::uint8_t> wanted) const {
  std::vector<BlockRun> runs;
  std::size_t tile = 0;
  for (int theta = 0; theta < task_.lattice.theta_rad.count; ++theta) {
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x, ++tile) {
        if (wanted[tile] != 0) {
          append_block(theta, y, x, runs);
        }
      }
    }
  }
  return runs;
}

void MovingObject::follow(std::vector<std::uint8_t> tiles) {
  followed_ = std::move(tiles);
  runs_ = runs_of(followed_);
}

void MovingObject::leave_others(const TileBeliefs& tiles) {
  const PoseLattice& lattice = task_.lattice;
  parallel_for(static_cast<std::size_t>(lattice.theta_rad.count), [&](std::size_t theta) {
    for (int y = 0; y < lattice.y_mm.count; ++y) {
      const std::size_t row =
          (theta * lattice.y_mm.count + y) * static_cast<std::size_t>(lattice.x_mm.count);
      const std::size_t first = (theta * rows_ + y / side) * columns_;
      for (int x = 0; x < lattice.x_mm.count; ++x) {
        if (const std::size_t tile = first + x / side; followed_[tile] == 0) {
          log_mass_[row + x] = -infinity;
          log_rest_[row + x] = tiles.bound[tile] - log_bins_of(tile);
        }
      }
    }
  });
}

}  // namespace palpate
