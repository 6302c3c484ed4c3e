#include "estimation/bounded/displaced/places.hpp"

namespace palpate {

void append_block(int theta, int y, int x, std::vector<BlockRun>& runs) {
  if (!runs.empty() && runs.back().theta == theta && runs.back().y == y &&
      runs.back().x + runs.back().count == x) {
    ++runs.back().count;
  } else {
    runs.push_back({theta, y, x, 1});
  }
}

BlockSet::BlockSet(const BlockRange& range)
    : range_(range),
      width_(static_cast<std::size_t>(range.x_end - range.x_first)),
      in_(width_ * static_cast<std::size_t>(range.y_end - range.y_first)) {}

void BlockSet::add(const BlockRange& blocks) {
  for (int y = blocks.y_first; y < blocks.y_end; ++y) {
    std::fill_n(in_.begin() + static_cast<std::ptrdiff_t>(index(blocks.x_first, y)),
                blocks.x_end - blocks.x_first, std::uint8_t{1});
  }
}

BlockSet BlockSet::with_neighbours(int x_blocks, int y_blocks, int x_count, int y_count) const {
  BlockSet all(range_);
  for (const BlockRun& run : runs(0)) {
    all.add({.x_first = std::max({range_.x_first, 0, run.x - x_blocks}),
             .x_end = std::min({range_.x_end, x_count, run.x + run.count + x_blocks}),
             .y_first = std::max({range_.y_first, 0, run.y - y_blocks}),
             .y_end = std::min({range_.y_end, y_count, run.y + 1 + y_blocks})});
  }
  return all;
}

std::vector<BlockRun> BlockSet::runs(int theta) const {
  std::vector<BlockRun> runs;
  for (int y = range_.y_first; y < range_.y_end; ++y) {
    for (int x = range_.x_first; x < range_.x_end; ++x) {
      if (in_[index(x, y)] != 0) {
        append_block(theta, y, x, runs);
      }
    }
  }
  return runs;
}

}  // namespace palpate
