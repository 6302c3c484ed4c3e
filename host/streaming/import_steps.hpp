#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "io/pose_table.hpp"
#include "io/pressure_table.hpp"
#include "palpate/touch.hpp"
#include "streaming/table_import.hpp"

// The steps of import_tables().

namespace palpate {

/// What an import has to know of all readings.
struct ImportSurvey {
  /// [n] how far the most loaded living element reads above its least reading so far.
  std::vector<float> load;
  std::vector<std::uint8_t> read;  ///< [e] 1: has a reading, dead or not
  /// The largest reading where all are whole numbers and some are large, as raw ones are.
  std::optional<double> whole_up_to;

  std::size_t rows() const { return load.size(); }
  /// [n] whether the array is pressed: at least half as much as in any row.
  std::vector<bool> pressed() const;
};
/// @param recording its elements, pressures (NaN: Unknown) and `valid`, which is empty or [e]
ImportSurvey survey_of(const Recording& recording);

/// Columns and rows of `array` where it is a grid of more than one row; none of a file.
std::optional<std::array<std::size_t, 2>> grid_size(const ImportOptions& options);

/// Reads `array`, its elements in the order of their readings, as a grid or as a file, or takes the
/// elements of a program; checks `pressure-unit`.
/// @throws Error naming the option, or the file's line and column
Recording import_array(const ImportOptions& options);

/// Marks as dead the elements without any reading. In touches, which have no unknown readings, it
/// also marks single readings.
/// @throws Error naming `path` where no element has any
void mark_unknown(const std::string& path, const ImportSurvey& survey, Recording& recording);

/// The normal that `plane` gives as "NX,NY,NZ"; none of "auto". @throws Error naming the option
std::optional<glm::dvec3> plane_normal(const std::string& plane);

/// Takes a table's poses in space into the plane of the touches, with their heights above it, turns
/// the recording's array over where it faces down, gives it its findings "tilt", and its truth
/// where the object's pose in space is known.
///
/// The plane lies across the mean direction in which the array looks: it is the robot's xy plane
/// where that is within 3 degrees of it. The normal points to the side of the robot's z, or in a
/// steep plane of its x or y.
/// @param normal of the plane, of any length; none: found
/// @returns what to say of the plane, in sentences
/// @throws Error naming the option `plane` where the array looks in all directions
std::vector<std::string> take_into_plane(const std::optional<glm::dvec3>& normal,
                                         const std::optional<SpatialPose>& T_robot_object,
                                         const ImportSurvey& survey, PoseTable& poses,
                                         Recording& recording);

/// True where `poses` is the table of the pressures, under this or another path.
bool in_one_file(const ImportOptions& options);

/// Lays the stretches between which the clock of tables steps back one behind another, with 10 s
/// between them: a stretch of the pressures and one of the poses belong together.
/// @returns what to say of them, in sentences that begin with file and line
/// @throws Error naming file and line where the two tables step back unlike often
std::vector<std::string> lay_out_stretches(const ImportOptions& options, PressureTable& pressures,
                                           std::optional<PoseTable>& poses);

/// Gives every row of the recording its pose, by time or row by row, and adds the finding "clock"
/// where presses and poses show it.
/// @throws Error where no row finds a pose
void join(PoseTable poses, const ImportSurvey& survey, const ImportOptions& options,
          ImportedRecording& imported);

}  // namespace palpate
