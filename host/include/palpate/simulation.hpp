#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// A raised planar shape in its object frame, in mm: the union of its strokes and filled polygons.
struct PALPATE_API Shape {
  struct Stroke {
    std::vector<glm::dvec2> points_mm;  ///< a polyline, with round caps and joints
    double width_mm = 0.0;
  };
  std::string label;
  std::vector<Stroke> strokes;
  std::vector<std::vector<glm::dvec2>> polygons;  ///< together filled by the even-odd rule

  bool contains(const glm::dvec2& p_object_mm) const;  ///< true for a point on the shape
};

/// Returns the shape that make_shape() knows by this name without a file; none for other names.
PALPATE_API std::optional<Shape> built_in_shape(const std::string& name);

/// Makes a shape: a capital letter "A".."Z" or digit "0".."9" about 25 mm high, "ring", "bar", or
/// the polygons of a file: lines "x y" in mm, an empty line between polygons, '#' starts a comment.
/// @throws Error (Fault::input) naming the file and line, or the shapes that there are
PALPATE_API Shape make_shape(const std::string& name_or_file);

/// The sensor of Pezzementi et al. (Haptics Symposium 2010), the paper's reference [19]: the
/// shape's displacement map convolved with a Gaussian point spread and averaged over the element's
/// area, scaled by a press force that varies from touch to touch and by a gain per element, with
/// additive noise and no negative readings.
struct SensorModel {
  double psf_mm = 1.0;                       ///< standard deviation of the point spread
  double element_mm = digitacts_element_mm;  ///< edge of a square element
  double pressure_kpa = 20.0;                ///< mean reading of an element wholly on the shape
  double force_spread = 0.15;                ///< relative standard deviation of the press force
  double gain_spread = 0.05;                 ///< relative standard deviation of the elements' gains
  double noise_kpa = 0.7;                    ///< standard deviation of the additive noise
};

/// Simulates touches of one shape with one array. The same seed gives the same recording. touch()
/// of a moved-from simulator throws Error.
class PALPATE_API Simulator {
 public:
  /// @throws Error on a shape without area, an array without elements, or a value out of range
  Simulator(const Shape& shape, const SensorModel& model, std::vector<glm::dvec2> elements_mm,
            std::uint64_t seed);
  ~Simulator();
  Simulator(Simulator&&) noexcept;
  Simulator& operator=(Simulator&&) noexcept;

  /// Simulates touches at these sensor poses, [n], with the object at T_object_robot: pressures in
  /// kPa, [n, e], and times from 0 s on, 0.5 s apart. Calls share one sequence of random numbers.
  Recording touch(const std::vector<Pose>& T_robot_sensor, const Pose& T_object_robot);

 private:
  struct PALPATE_LOCAL Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the 192 training poses T_object_sensor of Sec. II: 4 x 4 positions 6.8 mm apart around
/// the object's origin, 12 angles at each.
PALPATE_API std::vector<Pose> training_grid();
/// Returns n poses T_object_sensor, uniform over the training grid's extent and all angles.
PALPATE_API std::vector<Pose> random_poses(int n, std::uint64_t seed);
/// Returns a T_object_robot, uniform over [-10, 10]^2 mm and all angles (Sec. IV).
PALPATE_API Pose random_object_pose(std::uint64_t seed);

}  // namespace palpate
