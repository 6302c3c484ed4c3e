#include <algorithm>
#include <functional>
#include <tuple>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"

// Bins of displaced touches: the logs of each touch's mean likelihood, added up.

namespace palpate {

namespace {

constexpr int side = BlockRun::side;

/// The blocks of 4 x 4 bins that boxes of one object lie in, and sums for all of their bins.
class BlockSums {
 public:
  explicit BlockSums(std::span<const BinBox> boxes) {
    std::vector<std::tuple<int, int, int>> blocks;
    for (const BinBox& box : boxes) {
      for (int y = box.y_first / side; side * y < box.y_first + box.y_count; ++y) {
        for (int x = box.x_first / side; side * x < box.x_first + box.x_count; ++x) {
          blocks.emplace_back(box.theta, y, x);
        }
      }
    }
    std::ranges::sort(blocks);
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    for (const auto& [theta, y, x] : blocks) {
      const std::size_t runs = runs_.size();
      append_block(theta, y, x, runs_);
      if (runs_.size() > runs) {
        first_.push_back(log_likelihood_.size());
      }
      log_likelihood_.resize(log_likelihood_.size() + BlockRun::places);
    }
  }

  std::span<const BlockRun> runs() const { return runs_; }
  void add(std::span<const double> log_means) {
    std::ranges::transform(log_likelihood_, log_means, log_likelihood_.begin(), std::plus());
  }
  /// Copies the sums of a box's bins, [y, x].
  void copy(const BinBox& box, double* to) const {
    const auto after = [](const BlockRun& run) { return std::tuple(run.theta, run.y, run.x); };
    for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
      // A box's bins of a row lie in one run.
      const auto run = std::ranges::upper_bound(
                           runs_, std::tuple(box.theta, y / side, box.x_first / side), {}, after) -
                       1;
      const std::size_t first = first_[static_cast<std::size_t>(run - runs_.begin())];
      for (int x = box.x_first; x < box.x_first + box.x_count; ++x) {
        const auto block = static_cast<std::size_t>(x / side - run->x);
        const std::size_t bin = first + block * BlockRun::places +
                                static_cast<std::size_t>(side * (y % side) + x % side);
        *to++ = log_likelihood_[bin];
      }
    }
  }

 private:
  std::vector<BlockRun> runs_;
  std::vector<std::size_t> first_;  ///< [run] its first bin's place in what follows
  std::vector<double> log_likelihood_;
};

}  // namespace

void BinLikelihood::evaluate_blocks(std::size_t object, std::span<const BlockRun> runs,
                                    const KnownElements& touch,
                                    const PlaceRows<double>& rows) const {
  std::vector<BinBox> parts;
  std::size_t bins = 0;
  for (const BlockRun& run : runs) {
    BinBox& part = parts.emplace_back(
        BinBox{.object = static_cast<std::int32_t>(object),
               .theta = run.theta,
               .y_first = side * run.y,
               .y_count = std::min(side, lattice_.y_mm.count - side * run.y),
               .x_first = side * run.x,
               .x_count = std::min(side * run.count, lattice_.x_mm.count - side * run.x)});
    bins += static_cast<std::size_t>(part.bins());
  }
  std::vector<double> values(bins);
  evaluate_alone(parts, touch, values.data());
  auto value = values.begin();
  for (const BinBox& part : parts) {
    for (int y = part.y_first; y < part.y_first + part.y_count; ++y) {
      std::copy(value, value + part.x_count, rows.at(part.x_first, y));
      value += part.x_count;
    }
  }
}

void BinLikelihood::evaluate_displaced(std::span<const BinBox> boxes, const KnownElements& elements,
                                       std::span<double> log_likelihood) const {
  // The order in which touches came must show in no bit.
  const std::span<const KnownElements> items = elements.items();
  const std::vector<std::size_t> order = sorted_touches(items);
  double* to = log_likelihood.data();
  for (std::size_t first = 0, end = 0; first < boxes.size(); first = end) {
    while (end < boxes.size() && boxes[end].object == boxes[first].object) {
      ++end;
    }
    const std::span<const BinBox> of_object = boxes.subspan(first, end - first);
    const auto object = static_cast<std::size_t>(boxes[first].object);
    BlockSums sums(of_object);
    for (const std::size_t i : order) {
      const KnownElements& touch = items[i];
      const auto source = [&](std::span<const BlockRun> runs, const PlaceRows<double>& rows) {
        if (touch.undisplaced_bins == nullptr) {
          evaluate_blocks(object, runs, touch, rows);
          return;
        }
        const std::vector<BlockRun> others = touch.undisplaced_bins->copy(object, runs, rows);
        evaluate_blocks(object, others, touch, rows);
        touch.undisplaced_bins->keep(object, others, rows);
      };
      sums.add(displaced_->means(touch.sensor_from_pivot_mm, sums.runs(), source));
    }
    for (const BinBox& box : of_object) {
      sums.copy(box, to);
      to += box.bins();
    }
  }
}

}  // namespace palpate
