#include "recognition/warnings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "model/angle_unit.hpp"
#include "model/bounding_box.hpp"
#include "model/element_spacing.hpp"

namespace palpate {

namespace {

/// The cells of a map, in the object frame. The box is no tighter than the grid, so that it costs
/// no look at the cells.
BoundingBox cells_of(const OccupancyGrid& map) {
  BoundingBox box;
  box.take_in(map.origin_mm - map.cell_mm / 2.0);
  box.take_in(map.centre_mm(map.nx - 1, map.ny - 1) + map.cell_mm / 2.0);
  return box;
}

/// "1 touch", "2 touches"
std::string touches_in_words(std::size_t touches) {
  return fmt::format("{} touch{}", touches, touches == 1 ? "" : "es");
}

/// Whether two touches felt something else: whether more than a tenth of the elements that both
/// know read differently.
bool differ(const TouchEvidence& a, const TouchEvidence& b) {
  std::size_t known = 0;
  std::size_t different = 0;
  for (std::size_t i = 0; i < std::min(a.readings.size(), b.readings.size()); ++i) {
    if (a.readings[i] != Reading::unknown && b.readings[i] != Reading::unknown) {
      ++known;
      different += is_contact(a.readings[i]) != is_contact(b.readings[i]) ? 1 : 0;
    }
  }
  return 10 * different > known;
}

/// Distance by which the poses of a region keep an array from a map, or 0 or less where some pose
/// brings the array to the map. Angles count as free, so that the distance is never too large.
/// @param from_pivot_mm the array's middle minus the pivot
/// @param array_mm diagonal of the array
double gap_mm(const glm::dvec2& from_pivot_mm, double array_mm, const BoundingBox& cells,
              const PoseLattice& region) {
  // p_o = R(theta) from_pivot + (x, y) is in the box of cells where R(theta) from_pivot is in this
  // box.
  const glm::dvec2 lower = cells.lower - glm::dvec2(region.x_mm.upper, region.y_mm.upper);
  const glm::dvec2 upper = cells.upper - glm::dvec2(region.x_mm.lower, region.y_mm.lower);
  const double nearest = glm::length(glm::max(glm::max(lower, -upper), glm::dvec2(0.0)));
  const double farthest = glm::length(glm::max(glm::abs(lower), glm::abs(upper)));
  const double distance = glm::length(from_pivot_mm);
  return std::max(nearest - distance, distance - farthest) - array_mm / 2.0;
}

}  // namespace

std::optional<std::string> positions_in_metres(std::span<const TouchEvidence> touches) {
  // Arms reach 2 m, and touches of one object lie within 1 m. Presses in one place differ by less
  // than 0.001 mm where they are copies of one number. In mm, presses within 1 mm and 2 mm from the
  // origin would all feel alike.
  constexpr double reach = 2.0;
  constexpr double widest = 1.0;
  constexpr double narrowest = 1e-3;
  constexpr double same_angle_rad = 0.1;
  if (touches.size() < 3) {
    return {};
  }
  BoundingBox positions;
  for (const TouchEvidence& touch : touches) {
    positions.take_in(touch.T_robot_sensor.translation_mm);
  }
  const double span = positions.diagonal();
  const glm::dvec2 farthest = glm::max(glm::abs(positions.lower), glm::abs(positions.upper));
  if (!(std::max(farthest.x, farthest.y) < reach && span < widest && span > narrowest)) {
    return {};
  }
  const bool alike = std::all_of(touches.begin(), touches.end(), [&](const TouchEvidence& touch) {
    const double turn_rad =
        wrap_angle(touch.T_robot_sensor.theta_rad - touches.front().T_robot_sensor.theta_rad,
                   2.0 * std::numbers::pi);
    return std::abs(turn_rad) < same_angle_rad && !differ(touch, touches.front());
  });
  if (alike) {
    return {};
  }
  return fmt::format(
      "the sensor's positions span {:.2g} mm over {}, which differ in angle or in what they feel: "
      "are the positions in metres? Palpate takes millimetres; import them with `pose-unit m,rad`, "
      "or multiply x and y of sensor_pose by 1000",
      span, touches_in_words(touches.size()));
}

std::optional<std::string> angles_in_degrees(std::span<const TouchEvidence> touches) {
  const auto [least, most] = std::minmax_element(
      touches.begin(), touches.end(), [](const TouchEvidence& a, const TouchEvidence& b) {
        return a.T_robot_sensor.theta_rad < b.T_robot_sensor.theta_rad;
      });
  const double least_rad = least->T_robot_sensor.theta_rad;
  const double most_rad = most->T_robot_sensor.theta_rad;
  if (!seem_degrees(least_rad, most_rad)) {
    return {};
  }
  const auto largest = most_rad > -least_rad ? most : least;
  return fmt::format(
      "the sensor's angle is {:.4g} rad at touch {}, beyond a full turn of 6.283 rad: are the "
      "angles in degrees? Palpate takes radians; import them with `pose-unit mm,deg`, or multiply "
      "theta of sensor_pose by 0.0174533",
      largest->T_robot_sensor.theta_rad, largest - touches.begin() + 1);
}

std::optional<std::string> other_scale(std::span<const TouchEvidence> touches,
                                       const RecognitionTask& task) {
  const std::span<const glm::dvec2> elements_mm = touches.front().elements_mm;
  if (elements_mm.size() < 2) {
    return {};  // a single element has no scale
  }
  const double array_mm = bounding_box(touches.front().elements_mm).diagonal();
  const double pitch_mm = spacing_of(elements_mm)->nearest_mm.least;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    const OccupancyGrid& map = hypothesis.map;
    const double map_mm = cells_of(map).diagonal();
    if (map.cell_mm > array_mm) {
      return fmt::format(
          "the array measures {:.2g} mm across, less than one cell of {:.2g} mm of map '{}': one "
          "of them is not in millimetres; check the unit of the array's elements, then of the map",
          array_mm, map.cell_mm, map.label);
    }
    if (map_mm < pitch_mm) {
      return fmt::format(
          "map '{}' measures {:.2g} mm across, less than the {:.2g} mm between two elements of the "
          "array: one of them is not in millimetres; check the unit of the map, then of the "
          "array's elements",
          map.label, map_mm, pitch_mm);
    }
  }
  return {};
}

std::optional<std::string> nothing_felt(std::span<const TouchEvidence> touches, double threshold) {
  constexpr std::size_t few = 3;  // a touch or two may well miss the object, or lie wholly on it
  bool contact = false;
  bool none = false;
  double largest = -std::numeric_limits<double>::infinity();
  double least = std::numeric_limits<double>::infinity();
  for (const TouchEvidence& touch : touches) {
    contact = contact || touch.in_contact();
    none = none || std::ranges::count(touch.readings, Reading::no_contact) > 0;
    largest = std::max(largest, touch.largest_pressure);
    least = std::min(least, touch.least_pressure);
    // Eq. 3 compares a single element with itself, and so never finds it out of contact.
    if (contact && (none || touch.readings.size() == 1)) {
      return {};
    }
  }
  const std::string over = "in " + touches_in_words(touches.size());
  if (largest < least) {
    return fmt::format(
        "no element is alive and has a number for its pressure {}: check the "
        "recording's pressure and valid",
        over);
  }
  const std::string evidence = fmt::format(
      "pressures range from {:.3g} to {:.3g}, and the contact threshold is {:.3g}, in the "
      "recording's unit",
      least, largest, threshold);
  if (touches.size() < few) {
    return {};
  }
  if (!contact && !none) {
    return fmt::format(
        "no element is known to be in contact or out of contact {}: {}; choose a "
        "`threshold` within that range, and a `ratio` above 0",
        over, evidence);
  }
  return contact ? fmt::format(
                       "no element is ever out of contact {}: {}; choose a `threshold` "
                       "above the pressure of an untouched element, or tare the sensor",
                       over, evidence)
                 : fmt::format(
                       "no element is ever in contact {}: {}; choose a `threshold` below "
                       "the pressure of a touched element, or touch the object",
                       over, evidence);
}

std::optional<std::string> out_of_reach(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& region) {
  std::size_t contacts = 0;
  std::size_t beyond = 0;
  double nearest_mm = std::numeric_limits<double>::infinity();
  BoundingBox cells;           // of the nearest map
  double array_mm = 0.0;       // of a touch out of reach
  glm::dvec2 middles_mm{0.0};  // sum over the touches out of reach
  for (const TouchEvidence& touch : touches) {
    if (!touch.in_contact()) {
      continue;
    }
    ++contacts;
    const glm::dvec2 middle_mm = touch.middle_mm();
    const double diagonal_mm = bounding_box(touch.elements_mm).diagonal();
    double gap = std::numeric_limits<double>::infinity();
    BoundingBox nearest;
    for (const Hypothesis& hypothesis : task.hypotheses) {
      const BoundingBox box = cells_of(hypothesis.map);
      const double mm = gap_mm(middle_mm - region.pivot_mm, diagonal_mm, box, region);
      if (mm < gap) {
        gap = mm;
        nearest = box;
      }
    }
    if (gap <= 0.0) {
      continue;
    }
    ++beyond;
    middles_mm += middle_mm;
    array_mm = diagonal_mm;
    if (gap < nearest_mm) {
      nearest_mm = gap;
      cells = nearest;
    }
  }
  if (2 * beyond <= contacts) {
    return {};
  }
  const std::string evidence = fmt::format(
      "no pose of the region brings {} of {} in contact nearer than {:.1f} mm to any map", beyond,
      touches_in_words(contacts), nearest_mm);
  const glm::dvec2 middle_mm = middles_mm / static_cast<double>(beyond);
  if (task.auto_pivot) {
    return fmt::format(
        "{}: the array is on average {:.1f} mm from the first touch in contact; check that all "
        "touches are of one object that lay still, and that the positions are in mm",
        evidence, glm::distance(middle_mm, region.pivot_mm));
  }
  // A pivot among the touches brings them into the region; the region must then meet the map.
  const std::string ranges =
      gap_mm({0.0, 0.0}, array_mm, cells, region) <= 0.0
          ? ""
          : fmt::format(" `x-mm={:.1f}:{:.1f}` `y-mm={:.1f}:{:.1f}`", cells.lower.x, cells.upper.x,
                        cells.lower.y, cells.upper.y);
  return fmt::format(
      "{}: the array is on average {:.1f} mm from the pivot at {:g},{:g} mm; give "
      "`pivot-mm={:.1f},{:.1f}`{}, near the touches",
      evidence, glm::distance(middle_mm, region.pivot_mm), region.pivot_mm.x, region.pivot_mm.y,
      middle_mm.x, middle_mm.y, ranges);
}

}  // namespace palpate
