#include "estimation/touch_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

// Rectangles that come as close count as overlapping, as in sum_overlap.comp.glsl.
constexpr double touching_mm = 1e-3;

/// A length or place of which products stay finite. No region reaches so far.
glm::dvec2 within_reach(const glm::dvec2& mm) {
  static constexpr double far_mm = 1e30;
  const auto limit = [](double v) {
    return std::isnan(v) ? far_mm : std::clamp(v, -far_mm, far_mm);
  };
  return {limit(mm.x), limit(mm.y)};
}

}  // namespace

ArrayRectangle array_rectangle(const Pose& T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                               const glm::dvec2& pivot_mm) {
  const BoundingBox box = bounding_box(elements_mm);
  return {.from_pivot_mm = within_reach(T_robot_sensor * box.middle() - pivot_mm),
          .half_mm = within_reach(box.extent() / 2.0),
          .direction_rad = T_robot_sensor.theta_rad};
}

OverlapPlane::Line::Line(const Axis& axis)
    : first_mm(axis.centre(0)), step_mm(axis.step()), per_mm(1.0 / step_mm), last(axis.count - 1) {}

inline OverlapPlane::Bins OverlapPlane::Line::within(double low_mm, double high_mm) const {
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
  const double turned = rounding * (s * turned_reach_mm_.x + c * turned_reach_mm_.y);
  const double reach = std::min(reach_mm_.y, turned);
  rows_ = y_mm_.within(-reach - apart_mm_.y, reach - apart_mm_.y);
}

void OverlapPlane::find_rows(std::span<Bins> of_row) const {
  std::ranges::fill(of_row, Bins{});
  // Shadows that do not depend on x leave a row out, or do not bound it. All others bound it from
  // both sides, in an order that the slope's sign tells.
  struct Shadow {
    double slope;
    double per_slope;
    double per_row;
    double reach;
  };
  const Shadow shadows[] = {{cos_, per_cos_, sin_, turned_reach_mm_.x},
                            {-sin_, -per_sin_, cos_, turned_reach_mm_.y}};
  for (int y = rows_.first; y < rows_.first + rows_.count; ++y) {
    const double apart_y = apart_mm_.y + y_mm_.centre(y);
    double low = -reach_mm_.x;
    double high = reach_mm_.x;
    bool out = false;
    for (const Shadow& shadow : shadows) {
      const double offset = shadow.per_row * apart_y;
      if (shadow.slope == 0.0) {
        out = out || !(std::abs(offset) <= shadow.reach);
      } else {
        const double to_low = shadow.slope > 0.0 ? -shadow.reach : shadow.reach;
        low = std::max(low, (to_low - offset) * shadow.per_slope);
        high = std::min(high, (-to_low - offset) * shadow.per_slope);
      }
    }
    if (!out) {
      of_row[static_cast<std::size_t>(y)] = x_mm_.within(low - apart_mm_.x, high - apart_mm_.x);
    }
  }
}

std::int64_t count_bins(std::span<const OverlapPlane::Bins> rows, BinBox& around) {
  std::int64_t bins = 0;
  int x_first = std::numeric_limits<int>::max();
  int x_end = 0;
  int y_first = 0;
  int y_end = 0;
  for (int y = 0; y < static_cast<int>(rows.size()); ++y) {
    const auto [first, count] = rows[static_cast<std::size_t>(y)];
    if (count > 0) {
      y_first = bins == 0 ? y : y_first;
      y_end = y + 1;
      bins += count;
      x_first = std::min(x_first, first);
      x_end = std::max(x_end, first + count);
    }
  }
  if (bins > 0) {
    around.y_first = y_first;
    around.y_count = y_end - y_first;
    around.x_first = x_first;
    around.x_count = x_end - x_first;
  }
  return bins;
}

}  // namespace palpate
