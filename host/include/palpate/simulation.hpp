#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// A raised planar shape in its object frame, in mm: strokes of a width, and filled polygons.
struct Shape {
  struct Stroke {
    std::vector<glm::dvec2> points_mm;  ///< a polyline, with round caps and joints
    double width_mm = 0.0;
  };
  std::string label;
  std::vector<Stroke> strokes;
  std::vector<std::vector<glm::dvec2>> polygons;  ///< together filled by the even-odd rule

  bool contains(const glm::dvec2& p_object_mm) const;
};

/// The shape of this name that make_shape() knows without a file, if there is one.
std::optional<Shape> built_in_shape(const std::string& name);

/// A capital letter "A".."Z" or digit "0".."9" about 25 mm high, "ring", "bar", or the path of a
/// polygon file: lines "x y" in mm, an empty line between polygons, '#' starts a comment.
/// @throws Error naming the file and line, or what shapes there are.
Shape make_shape(const std::string& name_or_file);

/// The sensor of Pezzementi et al. (Haptics Symposium 2010), the paper's reference [19]: the
/// shape's displacement map convolved with a Gaussian point spread and averaged over the element's
/// area, scaled by a press force that varies from touch to touch and by a gain per element, with
/// additive noise and no negative readings.
struct SensorModel {
  double psf_mm = 1.0;                       ///< standard deviation of the point spread
  double element_mm = digitacts_element_mm;  ///< edge of a square element
  double pressure_kpa = 20.0;  ///< reading of an element wholly on the shape, on average
  double force_spread = 0.15;  ///< relative standard deviation of the press force
  double gain_spread = 0.05;   ///< relative standard deviation of the elements' gains
  double noise_kpa = 0.7;      ///< standard deviation of the additive noise
};

/// Simulated touches of one shape with one array. The same seed gives the same recording. A
/// simulator that was moved from throws Error when it is asked for touches.
class Simulator {
 public:
  /// @throws Error on a spread, element or noise out of range.
  Simulator(const Shape& shape, const SensorModel& model, std::vector<glm::dvec2> elements_mm,
            std::uint64_t seed);
  ~Simulator();
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;

  /// Touches at these sensor poses, [n], with the object at T_object_robot: pressures in kPa, [n,
  /// e], and times 0.5 s apart from 0. Every call goes on with the random numbers of the one
  /// before.
  Recording touch(const std::vector<Pose>& T_robot_sensor, const Pose& T_object_robot);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Sec. II: 4 x 4 positions 6.8 mm apart around the object's origin, 12 angles at each: 192 poses
/// T_object_sensor.
std::vector<Pose> training_grid();
/// n poses T_object_sensor, uniform over the training grid's extent and all angles.
std::vector<Pose> random_poses(int n, std::uint64_t seed);
/// T_object_robot uniform over [-10, 10]^2 mm and all angles (Sec. IV).
Pose random_object_pose(std::uint64_t seed);

}  // namespace palpate
