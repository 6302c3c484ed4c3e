#include "streaming/import_steps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "io/input_file.hpp"
#include "model/number_text.hpp"

namespace palpate {

namespace {

constexpr double degrees = 180.0 / std::numbers::pi;
constexpr double much_tilt_rad = 3.0 / degrees;
constexpr double much_height_mm = 2.0;

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// The mean of the sensor's z axis, shorter than 1 where it points in several directions.
glm::dvec3 mean_z(const std::vector<std::optional<SpatialPose>>& poses) {
  glm::dvec3 sum{0.0};
  double count = 0.0;
  for (const auto& pose : poses) {
    if (pose) {
      sum += pose->rotation * glm::dvec3(0.0, 0.0, 1.0);
      ++count;
    }
  }
  return count > 0.0 ? sum / count : glm::dvec3(0.0, 0.0, 1.0);
}

/// The normal of the plane across the direction in which the array looks.
glm::dvec3 normal_across(const glm::dvec3& looks) {
  constexpr double least = 0.7;  // of the mean's length: directions within some 45 degrees
  constexpr double steep = 0.5;  // of the normal's part along the robot's z
  if (glm::length(looks) < least) {
    refuse(
        "`plane`",
        "missing; the sensor's z axis points in unlike directions, so that the poses do not tell "
        "the plane of the touches: give its normal, such as 0,0,1");
  }
  const glm::dvec3 n = glm::normalize(looks);
  const double side = std::abs(n.z) > steep ? n.z : std::abs(n.x) >= std::abs(n.y) ? n.x : n.y;
  const glm::dvec3 towards = side < 0.0 ? -n : n;
  return angle_between(towards, {0.0, 0.0, 1.0}) <= much_tilt_rad ? glm::dvec3(0.0, 0.0, 1.0)
                                                                  : towards;
}

/// [pose] whether the array is pressed in the row of the pose, or in the one nearest in time.
std::vector<bool> pressed_poses(const PoseTable& poses, const Recording& recording,
                                const ImportSurvey& survey) {
  const std::vector<bool> rows =
      recording.rows == "touches" ? std::vector<bool>(survey.rows(), true) : survey.pressed();
  const std::vector<double>& time_s = recording.time_s;
  std::vector<bool> pressed(poses.spatial.size());
  for (std::size_t i = 0; i < pressed.size(); ++i) {
    std::size_t row = i;
    if (!poses.time_s.empty() && !time_s.empty()) {
      const double at_s = poses.time_s[i];
      row = static_cast<std::size_t>(std::ranges::lower_bound(time_s, at_s) - time_s.begin());
      if (row > 0 && (row == rows.size() || at_s - time_s[row - 1] < time_s[row] - at_s)) {
        --row;
      }
    }
    pressed[i] = row < rows.size() && rows[row];
  }
  return pressed;
}

/// The plane in which an array touches.
struct TouchPlane {
  glm::dvec3 normal;  ///< of the robot frame, of length 1
  /// The array looks against the normal, as under a tool that points down: seen from the normal's
  /// side its y axis is mirrored.
  bool faces_down = false;
  glm::dvec3 x{};  ///< axes in the plane, as the robot's x and y where it is its own
  glm::dvec3 y{};

  /// T_robot_sensor in the plane, of an array whose y axis is turned over where it faces down.
  Pose project(const SpatialPose& pose) const {
    const glm::dvec3 along = pose.rotation * glm::dvec3(1.0, 0.0, 0.0);
    return {{glm::dot(x, pose.translation_mm), glm::dot(y, pose.translation_mm)},
            std::atan2(glm::dot(y, along), glm::dot(x, along))};
  }
  double height_mm(const SpatialPose& pose) const { return glm::dot(normal, pose.translation_mm); }
  double tilt_rad(const SpatialPose& pose) const {
    return angle_between(pose.rotation * glm::dvec3(0.0, 0.0, 1.0), faces_down ? -normal : normal);
  }
};

TouchPlane touch_plane(const std::vector<std::optional<SpatialPose>>& poses,
                       const std::optional<glm::dvec3>& normal) {
  const glm::dvec3 looks = mean_z(poses);
  const glm::dvec3 n = normal ? glm::normalize(*normal) : normal_across(looks);
  TouchPlane plane{.normal = n, .faces_down = glm::dot(looks, n) < 0.0};
  constexpr double along = 0.9;
  const glm::dvec3 start =
      std::abs(n.x) > along ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0);
  plane.x = glm::normalize(start - glm::dot(start, n) * n);
  plane.y = glm::cross(n, plane.x);
  return plane;
}

/// What to say of the plane, in sentences.
std::vector<std::string> words_about(const TouchPlane& plane) {
  std::vector<std::string> words;
  const auto text = [](const glm::dvec3& v) {
    const glm::dvec3 r = glm::round(100.0 * v) / 100.0 + 0.0;  // without the sign of -0.00
    return fmt::format("({:g}, {:g}, {:g})", r.x, r.y, r.z);
  };
  if (plane.normal != glm::dvec3(0.0, 0.0, 1.0)) {
    words.push_back(fmt::format(
        "the touches' plane is turned by {:.1f} degrees out of the robot's xy plane: x and y are "
        "along {} and {} of the robot frame",
        angle_between(plane.normal, {0.0, 0.0, 1.0}) * degrees, text(plane.x), text(plane.y)));
  }
  if (plane.faces_down) {
    words.push_back(
        "the array looks against the plane's normal, as under a tool that points down: its y is "
        "turned over");
  }
  return words;
}

/// The findings "tilt": poses under load that lie tilted in the plane, or off it.
/// @param pressed [n] rows in which the array is pressed
std::vector<SetupFinding> tilt_of(const TouchPlane& plane,
                                  const std::vector<std::optional<SpatialPose>>& poses,
                                  const std::vector<bool>& pressed) {
  std::vector<SetupFinding> found;
  std::size_t tilted = 0;
  double most_rad = 0.0;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  std::size_t rows = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i] || !pressed[i]) {
      continue;
    }
    ++rows;
    const double tilt = plane.tilt_rad(*poses[i]);
    tilted += tilt > much_tilt_rad ? 1 : 0;
    most_rad = std::max(most_rad, tilt);
    low = std::min(low, plane.height_mm(*poses[i]));
    high = std::max(high, plane.height_mm(*poses[i]));
  }
  if (tilted > 0) {
    found.push_back(
        {"tilt", 0.0,
         fmt::format("{} of {} poses under load are tilted by more than {:.0f} degrees, {:.1f} at "
                     "most: press the array flat, or give the `plane`",
                     tilted, rows, much_tilt_rad * degrees, most_rad * degrees)});
  }
  if (high - low > much_height_mm) {
    found.push_back({"tilt", 0.0,
                     fmt::format("the height under load varies by {:.1f} mm: do all touches lie in "
                                 "one plane?",
                                 high - low)});
  }
  return found;
}

}  // namespace

std::optional<glm::dvec3> plane_normal(const std::string& plane) {
  if (plane == "auto") {
    return {};
  }
  const auto parts = split_text(plane, ',');
  glm::dvec3 normal{0.0};
  for (int i = 0; i < 3 && parts.size() == 3; ++i) {
    const auto number = number_of(parts[static_cast<std::size_t>(i)]);
    normal[i] = number.value_or(std::numeric_limits<double>::quiet_NaN());
  }
  if (!(glm::length(normal) > 0.0 && std::isfinite(glm::length(normal)))) {
    refuse(fmt::format("`plane {}`", plane),
           "give auto, or the plane's normal in the robot frame, such as 0,0,1");
  }
  return normal;
}

std::vector<std::string> take_into_plane(const std::optional<glm::dvec3>& normal,
                                         const std::optional<SpatialPose>& T_robot_object,
                                         const ImportSurvey& survey, PoseTable& poses,
                                         Recording& recording) {
  const TouchPlane plane = touch_plane(poses.spatial, normal);
  if (T_robot_object) {
    recording.truth = Truth{recording.object, inverse(plane.project(*T_robot_object))};
  }
  recording.findings = tilt_of(plane, poses.spatial, pressed_poses(poses, recording, survey));
  poses.T_robot_sensor.reserve(poses.spatial.size());
  poses.height_mm.reserve(poses.spatial.size());
  for (const auto& pose : poses.spatial) {
    poses.T_robot_sensor.push_back(pose ? plane.project(*pose) : unknown_pose);
    poses.height_mm.push_back(pose ? plane.height_mm(*pose) : unknown_pose.theta_rad);
  }
  poses.spatial = std::vector<std::optional<SpatialPose>>();  // frees the memory of a long log
  if (plane.faces_down) {
    for (glm::dvec2& p : recording.elements_mm) {
      p.y = -p.y;
    }
  }
  return words_about(plane);
}

}  // namespace palpate
