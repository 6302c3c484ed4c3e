#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "estimation/bounded/displaced/places.hpp"

namespace palpate {

/// Log-likelihoods of bins, in nats, as if their touch were undisplaced. Means over
/// displacements take the same bins again and again: for bins nearby, and for the belief after
/// further touches. Several threads may work on planes of different thetas.
class UndisplacedBins {
 public:
  /// Memory for all touches of a belief together, if each has its part.
  static constexpr std::size_t most_bytes = std::size_t{64} << 20;

  /// @param bytes that are held at most, about: what finds no room is not kept
  UndisplacedBins(std::size_t objects, std::size_t thetas, std::size_t bytes)
      : thetas_(thetas),
        planes_(objects * thetas),
        most_(static_cast<std::int64_t>(bytes / block_bytes)),
        room_(most_) {}

  /// Copies those bins that are kept. @returns the others
  /// @param runs of one theta
  std::vector<BlockRun> copy(std::size_t object, std::span<const BlockRun> runs,
                             const PlaceRows<double>& to) const {
    std::vector<BlockRun> others;
    for (const BlockRun& run : runs) {
      const Plane& plane = planes_[object * thetas_ + static_cast<std::size_t>(run.theta)];
      for (int x = run.x; x < run.x + run.count; ++x) {
        const auto kept = plane.find(place(run.y, x));
        if (kept == plane.end()) {
          append_block(run.theta, run.y, x, others);
          continue;
        }
        for (int j = 0; j < side; ++j) {
          std::copy_n(kept->second.data() + side * j, side, to.at(side * x, side * run.y + j));
        }
      }
    }
    return others;
  }
  /// Keeps bins that copy() did not find, as far as there is room.
  /// @param runs of one theta
  void keep(std::size_t object, std::span<const BlockRun> runs, const PlaceRows<double>& from) {
    for (const BlockRun& run : runs) {
      Plane& plane = planes_[object * thetas_ + static_cast<std::size_t>(run.theta)];
      for (int x = run.x; x < run.x + run.count; ++x) {
        if (--room_ < 0) {  // other threads take room, too
          ++room_;
          return;
        }
        Block& block = plane[place(run.y, x)];
        for (int j = 0; j < side; ++j) {
          std::copy_n(from.at(side * x, side * run.y + j), side, block.data() + side * j);
        }
      }
    }
  }
  /// Host memory of what is kept, about.
  std::size_t bytes() const { return static_cast<std::size_t>(most_ - room_) * block_bytes; }

 private:
  static constexpr int side = BlockRun::side;
  /// The bins of a block, [y, x].
  using Block = std::array<double, BlockRun::places>;
  /// Blocks by y and x.
  using Plane = std::unordered_map<std::uint64_t, Block>;
  /// With its place in the table.
  static constexpr std::size_t block_bytes = sizeof(Plane::value_type) + 3 * sizeof(void*);

  static std::uint64_t place(int y, int x) {
    return static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint32_t>(x);
  }

  std::size_t thetas_;
  std::vector<Plane> planes_;       ///< [object, theta]
  std::int64_t most_;               ///< blocks
  std::atomic<std::int64_t> room_;  ///< for so many blocks more
};

}  // namespace palpate
