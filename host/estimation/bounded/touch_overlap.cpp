#include "estimation/bounded/touch_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimation/bounded/parallel_for.hpp"

namespace palpate {

namespace {

// Rectangles that come as close count as overlapping, as in sum_overlap.comp.glsl.
constexpr double touching_mm = 1e-3;

constexpr double unbounded = std::numeric_limits<double>::infinity();

/// A length or place of which products stay finite. No region reaches so far.
glm::dvec2 within_reach(const glm::dvec2& mm) {
  static constexpr double far_mm = 1e30;
  const auto limit = [](double v) {
    return std::isnan(v) ? far_mm : std::clamp(v, -far_mm, far_mm);
  };
  return {limit(mm.x), limit(mm.y)};
}

/// An interval of reals.
struct Interval {
  double low = -unbounded;
  double high = unbounded;

  void cut(const Interval& other) {
    low = std::max(low, other.low);
    high = std::min(high, other.high);
  }
};

/// The u with |slope u + offset| <= reach.
/// @param per_slope 1 / slope
Interval within(double slope, double per_slope, double offset, double reach) {
  if (slope == 0.0) {
    return std::abs(offset) <= reach ? Interval{} : Interval{unbounded, -unbounded};
  }
  const double a = (-reach - offset) * per_slope;
  const double b = (reach - offset) * per_slope;
  return {std::min(a, b), std::max(a, b)};
}

/// Bins of a box's row y that a plane holds, counted from the box's first.
OverlapPlane::Bins in_row(const OverlapPlane& plane, const BinBox& box, int y) {
  const OverlapPlane::Bins row = plane.row(y);
  const int first = std::max(box.x_first, row.first);
  const int end = std::min(box.x_first + box.x_count, row.first + row.count);
  return {first - box.x_first, std::max(0, end - first)};
}

}  // namespace

ArrayRectangle array_rectangle(const Touch& touch, const glm::dvec2& pivot_mm) {
  const BoundingBox box = bounding_box(touch.elements_mm);
  return {.from_pivot_mm = within_reach(touch.T_robot_sensor * box.middle() - pivot_mm),
          .half_mm = within_reach(box.extent() / 2.0),
          .direction_rad = touch.T_robot_sensor.theta_rad};
}

OverlapPlane::Line::Line(const Axis& axis)
    : first_mm(axis.centre(0)), step_mm(axis.step()), per_mm(1.0 / step_mm), last(axis.count - 1) {}

OverlapPlane::Bins OverlapPlane::Line::within(double low_mm, double high_mm) const {
  if (!(step_mm > 0.0)) {
    return {0, low_mm <= first_mm && first_mm <= high_mm ? last + 1 : 0};
  }
  const double low = (low_mm - first_mm) * per_mm;
  const double high = (high_mm - first_mm) * per_mm;
  if (!(low <= last && high >= 0.0)) {
    return {};
  }
  // Casts round towards 0, and are faster than std::ceil.
  const int from = low > 0.0 ? static_cast<int>(low) : 0;
  const int first = from + (from < low ? 1 : 0);
  const int end = high < last ? static_cast<int>(high) + 1 : last + 1;
  return first < end ? Bins{first, end - first} : Bins{};
}

OverlapPlane::OverlapPlane(const ArrayRectangle& array, const BoundingBox& object,
                           const PoseLattice& lattice, int theta)
    : x_mm_(lattice.x_mm), y_mm_(lattice.y_mm) {
  const double theta_rad = lattice.theta_rad.centre(theta);
  apart_mm_ = rotate(theta_rad, array.from_pivot_mm) - object.middle();
  cos_ = std::cos(theta_rad + array.direction_rad);
  sin_ = std::sin(theta_rad + array.direction_rad);
  per_cos_ = 1.0 / cos_;
  per_sin_ = 1.0 / sin_;
  const double c = std::abs(cos_);
  const double s = std::abs(sin_);
  const glm::dvec2 half = object.extent() / 2.0;
  reach_mm_ = half +
              glm::dvec2(c * array.half_mm.x + s * array.half_mm.y,
                         s * array.half_mm.x + c * array.half_mm.y) +
              touching_mm;
  turned_reach_mm_ =
      array.half_mm + glm::dvec2(c * half.x + s * half.y, s * half.x + c * half.y) + touching_mm;
  // So far the turned rectangle of offsets reaches; rounding must not lose a bin.
  constexpr double rounding = 1.0 + 1e-9;
  const glm::dvec2 turned = rounding * glm::dvec2(c * turned_reach_mm_.x + s * turned_reach_mm_.y,
                                                  s * turned_reach_mm_.x + c * turned_reach_mm_.y);
  const glm::dvec2 reach = glm::min(reach_mm_, turned);
  columns_ = x_mm_.within(-reach.x - apart_mm_.x, reach.x - apart_mm_.x);
  rows_ = y_mm_.within(-reach.y - apart_mm_.y, reach.y - apart_mm_.y);
}

OverlapPlane::Bins OverlapPlane::row(int y) const {
  if (y < rows_.first || y >= rows_.first + rows_.count) {
    return {};
  }
  const double apart_y = apart_mm_.y + y_mm_.centre(y);
  Interval apart_x{-reach_mm_.x, reach_mm_.x};
  apart_x.cut(within(cos_, per_cos_, sin_ * apart_y, turned_reach_mm_.x));
  apart_x.cut(within(-sin_, -per_sin_, cos_ * apart_y, turned_reach_mm_.y));
  return x_mm_.within(apart_x.low - apart_mm_.x, apart_x.high - apart_mm_.x);
}

bool OverlapPlane::may_overlap(const Bins& x, const Bins& y) const {
  // The box of offsets, cut to what overlaps along the object's axes, against the turned rectangle.
  const auto cut = [](const Line& axis, const Bins& bins, const Bins& to) {
    const int first = std::max(bins.first, to.first);
    const int last = std::min(bins.first + bins.count, to.first + to.count) - 1;
    return first <= last ? Interval{axis.centre(first), axis.centre(last)}
                         : Interval{unbounded, -unbounded};
  };
  const Interval of_x = cut(x_mm_, x, columns_);
  const Interval of_y = cut(y_mm_, y, rows_);
  if (!(of_x.low <= of_x.high && of_y.low <= of_y.high)) {
    return false;
  }
  const glm::dvec2 half(std::midpoint(-of_x.low, of_x.high), std::midpoint(-of_y.low, of_y.high));
  const glm::dvec2 apart = apart_mm_ + glm::dvec2(std::midpoint(of_x.low, of_x.high),
                                                  std::midpoint(of_y.low, of_y.high));
  const double c = std::abs(cos_);
  const double s = std::abs(sin_);
  return std::abs(cos_ * apart.x + sin_ * apart.y) <=
             turned_reach_mm_.x + c * half.x + s * half.y + touching_mm &&
         std::abs(cos_ * apart.y - sin_ * apart.x) <=
             turned_reach_mm_.y + s * half.x + c * half.y + touching_mm;
}

std::int64_t OverlapPlane::bins() const {
  std::int64_t sum = 0;
  for (int y = rows_.first; y < rows_.first + rows_.count; ++y) {
    sum += row(y).count;
  }
  return sum;
}

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
