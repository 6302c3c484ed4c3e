#include "estimation/bounded/displaced/undisplaced_bins.hpp"

#include <algorithm>

namespace palpate {

namespace {

constexpr int side = BlockRun::side;

std::uint64_t place(int y, int x) {
  return static_cast<std::uint64_t>(y) << 32 | static_cast<std::uint32_t>(x);
}

}  // namespace

std::vector<BlockRun> UndisplacedBins::copy(std::size_t object, std::span<const BlockRun> runs,
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

void UndisplacedBins::keep(std::size_t object, std::span<const BlockRun> runs,
                           const PlaceRows<double>& from) {
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

}  // namespace palpate
