#include "estimation/bounded/counted_bins.hpp"

#include <algorithm>

#include "estimation/log_sum.hpp"

namespace palpate {

OverlapPlane::Bins CountedPlane::in_row(const BinBox& box, int y) const {
  const OverlapPlane::Bins& row = rows[static_cast<std::size_t>(y)];
  const int first = std::max(box.x_first, row.first);
  return {first, std::max(0, std::min(box.x_first + box.x_count, row.first + row.count) - first)};
}

bool CountedPlane::any_in(const BinBox& box) const {
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    if (in_row(box, y).count > 0) {
      return true;
    }
  }
  return false;
}

std::int64_t CountedPlane::outside(const BinBox& box) const {
  std::int64_t inside = 0;
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    inside += in_row(box, y).count;
  }
  return bins - inside;
}

CountedPlane CountedBins::plane(std::size_t object, int theta) const {
  CountedPlane plane{.theta = theta};
  plane.rows.resize(static_cast<std::size_t>(lattice_.y_mm.count));
  if (everywhere_) {
    std::ranges::fill(plane.rows, OverlapPlane::Bins{0, lattice_.x_mm.count});
  } else {
    OverlapPlane(array_, space_.boxes[object], lattice_, theta).find_rows(plane.rows);
  }
  plane.around = {.object = static_cast<std::int32_t>(object), .theta = theta};
  plane.bins = count_bins(plane.rows, plane.around);
  return plane;
}

void CountedBoxes::add(const BinBox& box, const CountedPlane& plane) {
  boxes_.push_back(box);
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    rows_.push_back(plane.in_row(box, y));
  }
}

double CountedBoxes::log_sum(const BinLikelihood& likelihood, const KnownElements& elements) const {
  std::int64_t bins = 0;
  for (const BinBox& box : boxes_) {
    bins += box.bins();
  }
  std::vector<double> values(static_cast<std::size_t>(bins));
  likelihood.evaluate_undisplaced(boxes_, elements, values);
  LogSum sum;
  auto value = values.cbegin();
  auto row = rows_.cbegin();
  for (const BinBox& box : boxes_) {
    for (int y = 0; y < box.y_count; ++y, ++row, value += box.x_count) {
      for (int x = 0; x < row->count; ++x) {
        sum.add(value[row->first - box.x_first + x]);
      }
    }
  }
  return sum.log();
}

}  // namespace palpate
