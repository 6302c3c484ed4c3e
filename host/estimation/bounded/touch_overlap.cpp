#include "estimation/bounded/touch_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/bounded/parallel_for.hpp"

namespace palpate {

namespace {

/// Bins of a box's row y that a plane holds, counted from the box's first.
OverlapPlane::Bins in_row(const OverlapPlane& plane, const BinBox& box, int y) {
  const OverlapPlane::Bins row = plane.row(y);
  const int first = std::max(box.x_first, row.first);
  const int end = std::min(box.x_first + box.x_count, row.first + row.count);
  return {first - box.x_first, std::max(0, end - first)};
}

}  // namespace

TouchOverlap::TouchOverlap(const ArrayRectangle& array, std::span<const BoundingBox> boxes,
                           const PoseLattice& lattice)
    : thetas_(lattice.theta_rad.count) {
  planes_.reserve(boxes.size() * static_cast<std::size_t>(thetas_));
  for (const BoundingBox& box : boxes) {
    for (int theta = 0; theta < thetas_; ++theta) {
      planes_.emplace_back(array, box, lattice, theta);
    }
  }
}

double TouchOverlap::weighted_bins(std::span<const double> log_weight) const {
  const auto thetas = static_cast<std::size_t>(thetas_);
  std::vector<std::int64_t> bins(planes_.size());
  parallel_for(bins.size(), [&](std::size_t i) { bins[i] = planes_[i].bins(); });
  double sum = 0.0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    sum += std::exp(log_weight[i / thetas]) * static_cast<double>(bins[i]);
  }
  return sum;
}

bool TouchOverlap::may_hold(const BinBox& box) const {
  return plane(box).may_overlap({box.x_first, box.x_count}, {box.y_first, box.y_count});
}

BinBox TouchOverlap::cut(const BinBox& box) const {
  BinBox smallest = box;
  smallest.y_count = 0;
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    const auto [first, count] = in_row(plane(box), box, y);
    if (count == 0) {
      continue;
    }
    const int x_first = box.x_first + first;
    if (smallest.y_count == 0) {
      smallest = {box.object, box.theta, y, 1, x_first, count};
    } else {
      const int x_end = std::max(smallest.x_first + smallest.x_count, x_first + count);
      smallest.y_count = y - smallest.y_first + 1;
      smallest.x_first = std::min(smallest.x_first, x_first);
      smallest.x_count = x_end - smallest.x_first;
    }
  }
  return smallest;
}

std::int64_t TouchOverlap::bins(const BinBox& box) const {
  std::int64_t sum = 0;
  if (may_hold(box)) {
    for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
      sum += in_row(plane(box), box, y).count;
    }
  }
  return sum;
}

template <typename Value>
void TouchOverlap::leave_out_others(const BinBox& box, Value* values) const {
  constexpr Value least = std::numeric_limits<Value>::lowest();
  for (int y = 0; y < box.y_count; ++y, values += box.x_count) {
    const auto [first, count] = in_row(plane(box), box, box.y_first + y);
    if (count == 0) {
      std::fill_n(values, box.x_count, least);
    } else {
      std::fill_n(values, first, least);
      std::fill(values + first + count, values + box.x_count, least);
    }
  }
}

template void TouchOverlap::leave_out_others(const BinBox& box, float* values) const;
template void TouchOverlap::leave_out_others(const BinBox& box, double* values) const;

}  // namespace palpate
