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

/// The centres of an axis's bins.
class BinCentres {
 public:
  explicit BinCentres(const Axis& axis)
      : first_mm_(axis.centre(0)),
        step_mm_(axis.step()),
        per_mm_(1.0 / step_mm_),
        last_(axis.count - 1) {}

  double operator[](int bin) const { return first_mm_ + bin * step_mm_; }

  RowBins within(double low_mm, double high_mm) const {
    if (!(step_mm_ > 0.0)) {
      return {0, low_mm <= first_mm_ && first_mm_ <= high_mm ? last_ + 1 : 0};
    }
    const double low = (low_mm - first_mm_) * per_mm_;
    const double high = (high_mm - first_mm_) * per_mm_;
    if (!(low <= last_ && high >= 0.0)) {
      return {};
    }
    // Casts round towards 0, and are faster than std::ceil.
    const int from = low > 0.0 ? static_cast<int>(low) : 0;
    const int first = from + (from < low ? 1 : 0);
    const int end = high < last_ ? static_cast<int>(high) + 1 : last_ + 1;
    return first < end ? RowBins{first, end - first} : RowBins{};
  }

 private:
  double first_mm_;
  double step_mm_;
  double per_mm_;
  int last_;  ///< bin
};

}  // namespace

ArrayRectangle array_rectangle(const Pose& T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                               const glm::dvec2& pivot_mm) {
  const BoundingBox box = bounding_box(elements_mm);
  return {.from_pivot_mm = within_reach(T_robot_sensor * box.middle() - pivot_mm),
          .half_mm = within_reach(box.extent() / 2.0),
          .direction_rad = T_robot_sensor.theta_rad};
}

void find_overlap(const ArrayRectangle& array, const BoundingBox& object,
                  const PoseLattice& lattice, int theta, std::span<RowBins> rows) {
  const BinCentres x_mm(lattice.x_mm);
  const BinCentres y_mm(lattice.y_mm);
  const double theta_rad = lattice.theta_rad.centre(theta);
  // From the object's middle to the array's, at x = y = 0, and the array's direction.
  const glm::dvec2 apart_mm = rotate(theta_rad, array.from_pivot_mm) - object.middle();
  const double cosine = std::cos(theta_rad + array.direction_rad);
  const double sine = std::sin(theta_rad + array.direction_rad);
  const double c = std::abs(cosine);
  const double s = std::abs(sine);
  const glm::dvec2 half = object.extent() / 2.0;
  // Of |apart|, along the object's axes and along the array's.
  const glm::dvec2 reach_mm = half +
                              glm::dvec2(c * array.half_mm.x + s * array.half_mm.y,
                                         s * array.half_mm.x + c * array.half_mm.y) +
                              touching_mm;
  const glm::dvec2 turned_reach_mm =
      array.half_mm + glm::dvec2(c * half.x + s * half.y, s * half.x + c * half.y) + touching_mm;
  // So far the turned rectangle of offsets reaches; rounding must not lose a bin.
  constexpr double rounding = 1.0 + 1e-9;
  const double turned = rounding * (s * turned_reach_mm.x + c * turned_reach_mm.y);
  const double reach = std::min(reach_mm.y, turned);

  // Shadows that do not depend on x leave a row out, or do not bound it. All others bound it from
  // both sides, in an order that the slope's sign tells.
  struct Shadow {
    double slope;
    double per_slope;
    double per_row;
    double reach;
  };
  const double per_cosine = 1.0 / cosine;
  const double per_sine = 1.0 / sine;
  const Shadow shadows[] = {{cosine, per_cosine, sine, turned_reach_mm.x},
                            {-sine, -per_sine, cosine, turned_reach_mm.y}};
  std::ranges::fill(rows, RowBins{});
  const auto [first_row, row_count] = y_mm.within(-reach - apart_mm.y, reach - apart_mm.y);
  for (int y = first_row; y < first_row + row_count; ++y) {
    const double apart_y = apart_mm.y + y_mm[y];
    double low = -reach_mm.x;
    double high = reach_mm.x;
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
      rows[static_cast<std::size_t>(y)] = x_mm.within(low - apart_mm.x, high - apart_mm.x);
    }
  }
}

std::int64_t count_bins(std::span<const RowBins> rows, BinBox& around) {
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
