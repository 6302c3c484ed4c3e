#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace palpate {

/// Neighbouring blocks of 4 x 4 places along x, at one theta. A place is a bin or a tile of bins.
struct BlockRun {
  static constexpr int side = 4;
  static constexpr int places = side * side;

  int theta = 0;
  int y = 0;  ///< of the blocks, counted in blocks
  int x = 0;  ///< of the first block
  int count = 0;
};

/// Appends a block behind those that stand before it by theta, y and x.
inline void append_block(int theta, int y, int x, std::vector<BlockRun>& runs) {
  if (!runs.empty() && runs.back().theta == theta && runs.back().y == y &&
      runs.back().x + runs.back().count == x) {
    ++runs.back().count;
  } else {
    runs.push_back({theta, y, x, 1});
  }
}

/// A part of one theta's places, in rows.
template <typename Value>
struct PlaceRows {
  Value* first = nullptr;  ///< the place at (x, y)
  std::ptrdiff_t pitch = 0;
  int x = 0;
  int y = 0;

  Value* at(int place_x, int place_y) const {
    return first + (place_y - y) * pitch + (place_x - x);
  }
};

/// A touch's log-likelihoods, before they are averaged: sets those of the runs' places, all of one
/// theta, in nats. Places without bins keep what they hold. Is called on several threads.
template <typename Value>
using PlaceSource = std::function<void(std::span<const BlockRun>, const PlaceRows<Value>&)>;

}  // namespace palpate
