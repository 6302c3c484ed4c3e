#include "estimation/bounded/counted_bins.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "estimation/log_sum.hpp"

namespace palpate {

namespace {

/// Bounds of the log of a sum of likelihoods, each by its share.
/// @param logs of the likelihoods
/// @param error of every share, beside shares.relative_error()
LogInterval log_sum_by_shares(const std::vector<double>& logs, const std::vector<double>& of_bins,
                              double error, const OverlapShares& shares) {
  constexpr double nothing = -std::numeric_limits<double>::infinity();
  if (logs.empty() || std::ranges::max(logs) == nothing) {
    return {nothing, nothing};
  }
  const double largest = std::ranges::max(logs);
  double sum = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const double likelihood = std::exp(logs[i] - largest);
    sum += of_bins[i] * likelihood;
    all += likelihood;
  }
  // Each term of the sums rounds by a unit.
  const double relative =
      shares.relative_error() + 4.0 * static_cast<double>(logs.size()) * 0x1p-53;
  return {largest + std::log(std::max(sum - error * all, 0.0)) - relative,
          largest + std::log(sum + error * all) + relative};
}

}  // namespace

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

CountedBins::CountedBins(const SearchSpace& space, const PoseLattice& lattice,
                         const ArrayRectangle& array,
                         const std::optional<glm::dvec2>& sensor_from_pivot_mm, bool everywhere)
    : space_(space), lattice_(lattice), array_(array), everywhere_(everywhere) {
  if (sensor_from_pivot_mm) {
    shares_.emplace(*space.displacement, array, *sensor_from_pivot_mm, space.boxes, everywhere);
  }
}

CountedPlane CountedBins::plane(std::size_t object, int theta) const {
  CountedPlane plane{.theta = theta};
  plane.rows.resize(static_cast<std::size_t>(lattice_.y_mm.count));
  if (shares_) {
    plane.bins = shares_->overlapping(object, theta);
    plane.around = shares_->reach(object, theta);
    plane.log_most_share = std::log(shares_->most(object, theta));
    std::fill_n(plane.rows.begin() + plane.around.y_first, plane.around.y_count,
                OverlapPlane::Bins{plane.around.x_first, plane.around.x_count});
    return plane;
  }
  if (everywhere_) {
    std::ranges::fill(plane.rows, OverlapPlane::Bins{0, lattice_.x_mm.count});
  } else {
    OverlapPlane(array_, space_.boxes[object], lattice_, theta).find_rows(plane.rows);
  }
  plane.around = {.object = static_cast<std::int32_t>(object), .theta = theta};
  plane.bins = count_bins(plane.rows, plane.around);
  return plane;
}

CountedBins::ShareSum CountedBins::outside(const BinBox& box, const CountedPlane& plane,
                                           OverlapShares::Planes& looked_at) const {
  if (!shares_) {
    std::int64_t inside = 0;
    for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
      inside += plane.in_row(box, y).count;
    }
    return {.shares = static_cast<double>(plane.bins - inside)};
  }
  const BinBox& around = plane.around;
  const OverlapShares::Shares shares = shares_->at(around, looked_at);
  ShareSum sum;
  const double* share = shares.of_bins.data();
  for (int y = around.y_first; y < around.y_first + around.y_count; ++y) {
    const bool in_rows = y >= box.y_first && y < box.y_first + box.y_count;
    for (int x = around.x_first; x < around.x_first + around.x_count; ++x, ++share) {
      if (!in_rows || x < box.x_first || x >= box.x_first + box.x_count) {
        sum.shares += *share;
        sum.error += shares.error;
      }
    }
  }
  sum.error += sum.shares * (std::expm1(shares_->relative_error()) +
                             2.0 * static_cast<double>(around.bins()) * 0x1p-53);
  return sum;
}

void CountedBoxes::add(const BinBox& box, const CountedPlane& plane) {
  boxes_.push_back(box);
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    rows_.push_back(plane.in_row(box, y));
  }
}

LogInterval CountedBoxes::log_sum(const BinLikelihood& likelihood, const KnownElements& elements,
                                  Arithmetic arithmetic, const CountedBins& counted,
                                  OverlapShares::Planes& looked_at) const {
  std::int64_t bins = 0;
  for (const BinBox& box : boxes_) {
    bins += box.bins();
  }
  std::vector<double> values(static_cast<std::size_t>(bins));
  likelihood.evaluate_exact(boxes_, elements, arithmetic, values);
  std::vector<double> logs;
  auto value = values.cbegin();
  Rows row = rows_.cbegin();
  for (const BinBox& box : boxes_) {
    append_counted(box, value, box.x_count, row, logs);
    value += box.bins();
  }
  if (const std::optional<OverlapShares>& shares = counted.shares()) {
    double error = 0.0;
    const std::vector<double> of_bins = shares_of_bins(*shares, looked_at, error);
    return log_sum_by_shares(logs, of_bins, error, *shares);
  }
  LogSum sum;
  for (const double log : logs) {
    sum.add(log);
  }
  return {sum.log(), sum.log()};
}

void CountedBoxes::append_counted(const BinBox& box, std::vector<double>::const_iterator from,
                                  std::ptrdiff_t pitch, Rows& row, std::vector<double>& values) {
  for (int y = 0; y < box.y_count; ++y, ++row) {
    if (row->count > 0) {
      const auto first = from + y * pitch + (row->first - box.x_first);
      values.insert(values.end(), first, first + row->count);
    }
  }
}

std::vector<double> CountedBoxes::shares_of_bins(const OverlapShares& shares,
                                                 OverlapShares::Planes& looked_at,
                                                 double& error) const {
  std::vector<double> of_bins;
  Rows row = rows_.cbegin();
  for (std::size_t first = 0, end = 0; first < boxes_.size(); first = end) {
    BinBox around;
    for (; end < boxes_.size() && boxes_[end].theta == boxes_[first].theta; ++end) {
      around = smallest_around(around, boxes_[end]);
    }
    const OverlapShares::Shares at = shares.at(around, looked_at);
    error = std::max(error, at.error);
    for (const BinBox& box : std::span(boxes_).subspan(first, end - first)) {
      const auto from = at.of_bins.begin() +
                        std::ptrdiff_t{box.y_first - around.y_first} * around.x_count +
                        (box.x_first - around.x_first);
      append_counted(box, from, around.x_count, row, of_bins);
    }
  }
  return of_bins;
}

}  // namespace palpate
