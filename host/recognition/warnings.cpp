#include "recognition/decision.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "model/angle_unit.hpp"
#include "model/bounding_box.hpp"
#include "model/element_spacing.hpp"
#include "recognition/belief_cells.hpp"

namespace palpate {

namespace {

/// A sentence (see warnings_about()), or none where all looks right.
using Warning = std::optional<std::string>;

// Rules about the touches of an unknown, at least one.

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

/// The sensor's positions look like metres.
Warning positions_in_metres(std::span<const TouchEvidence> touches) {
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
  const TouchEvidence& first = touches.front();
  const bool alike = std::ranges::all_of(touches, [&](const TouchEvidence& touch) {
    const double turn_rad = touch.T_robot_sensor.theta_rad - first.T_robot_sensor.theta_rad;
    return std::abs(wrap_angle(turn_rad, 2.0 * std::numbers::pi)) < same_angle_rad &&
           !differ(touch, first);
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

/// The sensor's angles look like degrees.
Warning angles_in_degrees(std::span<const TouchEvidence> touches) {
  const auto theta_rad = [](const TouchEvidence& touch) { return touch.T_robot_sensor.theta_rad; };
  const auto [least, most] = std::ranges::minmax_element(touches, {}, theta_rad);
  if (!seem_degrees(theta_rad(*least), theta_rad(*most))) {
    return {};
  }
  const auto largest = theta_rad(*most) > -theta_rad(*least) ? most : least;
  return fmt::format(
      "the sensor's angle is {:.4g} rad at touch {}, beyond a full turn of 6.283 rad: are the "
      "angles in degrees? Palpate takes radians; import them with `pose-unit mm,deg`, or multiply "
      "theta of sensor_pose by 0.0174533",
      theta_rad(*largest), largest - touches.begin() + 1);
}

/// The array and a map have scales that do not fit together.
Warning other_scale(std::span<const TouchEvidence> touches, const RecognitionTask& task) {
  const auto& elements_mm = touches.front().elements_mm;
  if (elements_mm.size() < 2) {
    return {};  // a single element has no scale
  }
  const double array_mm = bounding_box(elements_mm).diagonal();
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

/// The threshold leaves no element known, or the touches tell nothing, since no element was ever in
/// contact or all were.
Warning nothing_felt(std::span<const TouchEvidence> touches, double threshold) {
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
  const std::string over = touches_in_words(touches.size());
  if (largest < least) {
    return fmt::format(
        "no element is alive and has a number for its pressure in {}: check the recording's "
        "pressure and valid",
        over);
  }
  if (touches.size() < few) {
    return {};
  }
  using Words = std::pair<const char*, const char*>;
  const auto [fault, remedy] =
      contact ? Words("ever out of contact",
                      "above the pressure of an untouched element, or tare the sensor")
      : none
          ? Words("ever in contact", "below the pressure of a touched element, or touch the object")
          : Words("known to be in contact or out of contact",
                  "within that range, and a `ratio` above 0");
  return fmt::format(
      "no element is {} in {}: pressures range from {:.3g} to {:.3g}, and the contact threshold is "
      "{:.3g}, in the recording's unit; choose a `threshold` {}",
      fault, over, least, largest, threshold, remedy);
}

/// No pose of the region brings most of the touches that have an element In Contact to any map.
Warning out_of_reach(std::span<const TouchEvidence> touches, const RecognitionTask& task,
                     const PoseLattice& region) {
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
    const auto gap_to = [&](const Hypothesis& object) {
      return gap_mm(middle_mm - region.pivot_mm, diagonal_mm, cells_of(object.map), region);
    };
    const auto nearest = std::ranges::min_element(task.hypotheses, {}, gap_to);
    const double gap = gap_to(*nearest);
    if (gap <= 0.0) {
      continue;
    }
    ++beyond;
    middles_mm += middle_mm;
    array_mm = diagonal_mm;
    if (gap < nearest_mm) {
      nearest_mm = gap;
      cells = cells_of(nearest->map);
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

// Rules about the estimate.

constexpr double degrees_per_rad = 180.0 / std::numbers::pi;
constexpr std::array axis_names{"x", "y", "theta"};

/// The refined pose's standard deviations are those of a bin, since the bins are too wide for the
/// refinement.
Warning coarse_bins(const RecognitionTask& task, const PoseLattice& lattice,
                    const RecognitionStep& step) {
  // docs/refinement.md: the refinement needs 20 bins within 2.5 mm, and steps up to about 1.5 mm.
  constexpr double widest_bin_mm3 = 4.0 / 3.0 * std::numbers::pi * 2.5 * 2.5 * 2.5 / 20.0;
  constexpr double widest_step_mm = 1.5;
  constexpr double own_share = 1.1;  // the belief adds less than a tenth to the bin's variance
  const std::optional<Body>& body = task.bodies[step.mode.object];
  if (!step.refined || !body) {
    return {};
  }
  const LatticePlace variances = variances_of(*step.refined, lattice);
  // How far the object moves, root mean square, where the pose moves by 1 mm or 1 rad.
  const LatticePlace lever_mm{1.0, 1.0, std::sqrt(body->inertia_mm2)};
  std::vector<std::string> coarse;
  std::array<int, 3> counts{};
  double bin_mm3 = 1.0;
  for (int i = 0; i < 3; ++i) {
    const Axis& axis = *axes_of(lattice)[i];
    const double step_mm = axis.step() * lever_mm[i];
    counts[i] = axis.count;
    if (axis.count == 1) {
      continue;
    }
    bin_mm3 *= step_mm;
    const double bins_own = axis.step() * axis.step() / 12.0;
    if (step_mm > widest_step_mm && variances[i] < own_share * bins_own) {
      coarse.push_back(
          i < 2 ? fmt::format("{} in bins of {:.3g} mm", axis_names[i], axis.step())
                : fmt::format("theta in bins of {:.3g} degrees, which turn the object by {:.2g} mm",
                              axis.step() * degrees_per_rad, step_mm));
      counts[i] = static_cast<int>(std::ceil(axis.count * step_mm / 1.0));
    }
  }
  if (coarse.empty() || bin_mm3 < widest_bin_mm3) {
    return {};
  }
  return fmt::format(
      "the pose's standard deviation is only the width of a bin: {}; give `bins {}x{}x{}` or more, "
      "or `bins auto`",
      fmt::join(coarse, ", "), counts[0], counts[1], counts[2]);
}

/// The best pose lies at an end of an axis.
Warning at_the_edge(std::span<const TouchEvidence> touches, const RecognitionTask& task,
                    const PoseLattice& lattice, const RecognitionStep& step) {
  // Fewer elements in contact do not tell one place from another: the best pose lies anywhere in
  // the region, its edges included.
  constexpr std::size_t enough = 24;  // two to three touches of a letter by the 6 x 6 array
  std::size_t contacts = 0;
  for (const TouchEvidence& touch : touches) {
    contacts += touch.contacts;
  }
  if (!step.refined || !step.mode.bin || contacts < enough) {
    return {};
  }
  const AxisIndices index = indices_of(lattice, *step.mode.bin);
  const LatticePlace place = place_of(*step.refined, lattice);
  const LatticePlace variances = variances_of(*step.refined, lattice);
  constexpr std::array options{"x-mm", "y-mm", "theta-deg"};
  for (int i = 0; i < 3; ++i) {
    const Axis& axis = *axes_of(lattice)[i];
    const bool first = index[i] == 0;
    if (axis.count < 3 || (i == 2 && lattice.full_circle()) ||
        !(first || index[i] == axis.count - 1)) {
      continue;
    }
    // Between the bins the pose may lie well inside, as that of an object within the region does.
    const double inside = first ? place[i] - axis.lower : axis.upper - place[i];
    if (inside > std::max(axis.step(), std::sqrt(variances[i]))) {
      continue;
    }
    const double unit = i < 2 ? 1.0 : degrees_per_rad;
    const double more = (axis.upper - axis.lower) / 2.0;
    const std::string remedy =
        task.auto_pivot
            ? "the region surrounds the first touch in contact; begin with a touch of the object"
            : fmt::format("widen the region, such as with `{}={:.4g}:{:.4g}`", options[i],
                          (axis.lower - (first ? more : 0.0)) * unit,
                          (axis.upper + (first ? 0.0 : more)) * unit);
    return fmt::format(
        "the best pose lies at the edge of the region, {} = {:.4g} {} of {:.4g} to {:.4g}: the "
        "object may lie outside; {}",
        axis_names[i], place[i] * unit, i < 2 ? "mm" : "degrees", axis.lower * unit,
        axis.upper * unit, remedy);
  }
  return {};
}

/// The belief has no peak about the pose.
Warning pose_untold(std::span<const TouchEvidence> touches, const RecognitionStep& step) {
  if (step.places.peak) {
    return {};
  }
  return std::ranges::any_of(touches, &TouchEvidence::in_contact)
             ? "the touches do not tell the pose: the belief has no peak about it"
             : "the touches do not tell the pose: no touch has an element In Contact";
}

}  // namespace

std::vector<std::string> warnings_about(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& lattice,
                                        const RecognitionStep& step) {
  std::vector<std::string> warnings;
  const auto add = [&](Warning warning) {
    if (warning) {
      warnings.push_back(*std::move(warning));
    }
  };
  add(positions_in_metres(touches));
  add(other_scale(touches, task));
  add(nothing_felt(touches, task.classifier().threshold));
  add(out_of_reach(touches, task, lattice));
  if (warnings.empty()) {
    add(pose_untold(touches, step));
  }
  const Warning degrees = angles_in_degrees(touches);
  // Touches at wrong angles do not fit; where the touches fit, the estimate deserves its warnings.
  const bool fits = step.fit && step.fit->verdict == Verdict::fits;
  const bool estimate_counts = warnings.empty() && (!degrees || fits);
  add(degrees);
  // An estimate from such touches is not worth a word. On bins that are too coarse, the edge is no
  // sign of an object outside.
  if (estimate_counts) {
    const Warning coarse = coarse_bins(task, lattice, step);
    add(coarse ? coarse : at_the_edge(touches, task, lattice, step));
  }
  return warnings;
}

}  // namespace palpate
