#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Something that is wrong with the set-up of a robot and its array.
struct SetupFinding {
  /// "pose_unit", "element_order", "array_offset", "pitch", "dead_elements", "stuck_elements",
  /// "contradicting", "unexplained", as touches say; "tilt", "clock" or "dropped", as logs do.
  std::string what;
  /// By how much more likely the touches are once it is mended; of "clock", log 19 for each press
  /// that it explains; 0 of "unexplained", "tilt" and "dropped", which are counted.
  double nats = 0.0;
  std::string words;                      ///< a sentence, options between `quotes`
  std::vector<std::string> options = {};  ///< that mend it together, such as "dead 13,42"
  /// Pose of the recordings' array in the true sensor frame, to be applied to the elements, with
  /// its standard deviations in mm, mm and rad.
  std::optional<Pose> array_offset = {};
  std::optional<std::array<double, 3>> sd = {};
};

/// Returns the element centres, [36] in mm in the sensor frame, of the central 6 x 6 region of two
/// PPS DigiTacts pads side by side: x = +-1.1, +-3.0, +-4.9, y = (k - 2.5) * 1.9; x varies fastest.
PALPATE_API std::vector<glm::dvec2> digitacts_array();

/// Edge length of a DigiTacts element, in mm.
inline constexpr double digitacts_element_mm = 1.8;

/// Returns the element centres of a grid, [columns * rows] in mm, centred about the sensor's
/// origin; x varies fastest, along the columns.
PALPATE_API std::vector<glm::dvec2> grid_array(int columns, int rows, double pitch_mm);

/// Pose of a frame whose pose is unknown: all NaN.
inline const Pose unknown_pose{
    {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()},
    std::numeric_limits<double>::quiet_NaN()};

/// One reading of the tactile array at a known pose. It is a view: the caller keeps the memory
/// alive. A touch is sound if its lists have one size, its pose and its element centres are finite,
/// and no living element's pressure is infinite. Whatever takes a touch throws Error on any other.
struct Touch {
  Pose T_robot_sensor;
  std::span<const glm::dvec2> elements_mm;   ///< [e] element centres in the sensor frame
  std::span<const double> pressure;          ///< [e] in the recording's unit
  std::span<const std::uint8_t> valid = {};  ///< [e] 0 = dead element; empty: all are alive
};

/// A touch that is classified already. The library keeps it to itself.
struct TouchEvidence;

/// The centre of the box around the elements, in mm in the frame of the elements; (0, 0) without
/// elements. The sensor frame's origin may lie elsewhere, such as at the robot's flange.
PALPATE_API glm::dvec2 array_centre_mm(std::span<const glm::dvec2> elements_mm);

/// The largest distance of an element from the array's centre, in mm; 0 without elements.
PALPATE_API double array_reach_mm(std::span<const glm::dvec2> elements_mm);

/// The true identity and pose of an unknown object.
struct Truth {
  std::string object;
  Pose T_object_robot;
};

/// A sequence of readings of one array pressed against one object.
struct PALPATE_API Recording {
  std::string path;                     ///< the file it was read from, for messages
  std::string object;                   ///< label, "" when unknown
  std::string pressure_unit = "kPa";    ///< "kPa" or "raw"
  std::string rows = "touches";         ///< "touches", or "frames" for a raw stream
  std::vector<Pose> T_robot_sensor;     ///< [n]
  std::vector<double> pressure;         ///< [n, e]
  std::vector<glm::dvec2> elements_mm;  ///< [e], or [n, e] where the array changes
  std::vector<std::uint8_t> valid;      ///< empty, [e] or [n, e]; 0 = dead element
  std::vector<double> time_s;           ///< empty or [n], since the Unix epoch
  std::optional<Truth> truth;
  /// What the logs that it was made of showed: "tilt", "clock" and "dropped".
  std::vector<SetupFinding> findings;

  // Fields of a stream of frames. In a stream, a pose may be NaN (unknown at that time), and so may
  // a pressure (Unknown).
  std::string sensor;                 ///< name of the sensor, "" when unknown
  std::string serial;                 ///< its serial number, "" if none
  std::vector<double> baseline;       ///< empty or [e]: untouched readings
  std::vector<double> device_time_s;  ///< empty or [n], by the sensor's own clock; NaN: unknown
  std::vector<std::uint64_t> lost_before;  ///< empty or [n]: frames lost since the last row
  bool closed = true;                      ///< false: cut off, or being recorded

  /// Number of touches, n.
  std::size_t size() const { return T_robot_sensor.size(); }
  /// Number of elements of the array, e.
  std::size_t elements() const { return size() == 0 ? 0 : pressure.size() / size(); }
  /// Returns touch i as a view into this recording, valid while the recording is unchanged.
  /// @throws Error unless i < size(), and on lists whose sizes disagree
  Touch touch(std::size_t i) const;
  /// Returns touches [begin, end) as such views.
  std::vector<Touch> touches(std::size_t begin, std::size_t end) const;
};

}  // namespace palpate
