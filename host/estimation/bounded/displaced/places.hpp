#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
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
void append_block(int theta, int y, int x, std::vector<BlockRun>& runs);

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

/// Blocks [first, end) along each axis.
struct BlockRange {
  int x_first = std::numeric_limits<int>::max();
  int x_end = 0;
  int y_first = std::numeric_limits<int>::max();
  int y_end = 0;

  bool empty() const { return x_first >= x_end || y_first >= y_end; }
  void take_in(const BlockRange& other) {
    x_first = std::min(x_first, other.x_first);
    x_end = std::max(x_end, other.x_end);
    y_first = std::min(y_first, other.y_first);
    y_end = std::max(y_end, other.y_end);
  }
};

/// A part of the blocks of one theta, within a range.
class BlockSet {
 public:
  explicit BlockSet(const BlockRange& range);

  void add(const BlockRange& blocks);
  /// All blocks within so many of these, as far as the range and the axes' blocks reach.
  BlockSet with_neighbours(int x_blocks, int y_blocks, int x_count, int y_count) const;
  std::vector<BlockRun> runs(int theta) const;

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - range_.y_first) * width_ +
           static_cast<std::size_t>(x - range_.x_first);
  }

  BlockRange range_;
  std::size_t width_;
  std::vector<std::uint8_t> in_;  ///< [y, x]
};

}  // namespace palpate
