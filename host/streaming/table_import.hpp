#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "io/pose_table.hpp"
#include "io/pressure_table.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The tables of 'palpate import', and what they hold; texts are as its options have them, "" where
/// one is not given.
struct ImportOptions : TableOptions {
  std::string pressures;
  std::string poses;
  std::string array;  ///< COLUMNS:ROWS:PITCH, or a file
  /// Corner of the grid whose element is read first, as seen with x to the right and y upwards:
  /// bottom-left, bottom-right, top-left or top-right.
  std::string first_element = "bottom-left";
  std::string order = "rows";  ///< of the grid's readings: row by row, or "columns"
  std::string dead;            ///< elements that do not read, counted from 0, such as "13,42"
  /// [e] of a program, in the place of `array`
  std::optional<std::vector<glm::dvec2>> elements_mm;
  std::string pressure_unit = "kPa";
  int sign = 1;  ///< -1: readings fall under load, and are taken times -1
  /// X,Y,Z,ROLL,PITCH,YAW, mm and degrees about fixed axes: the pose of the array in the frame
  /// whose poses are given; "": it is this frame.
  std::string mount;
  std::string plane = "auto";           ///< of poses in space: auto, or its normal "NX,NY,NZ"
  std::optional<double> largest_gap_s;  ///< none: by the times of the poses
  double pose_delay_s = 0.0;  ///< by how much later the poses' clock reads than the frames'
  std::optional<double> rate_hz;
  std::string rows;
  std::string object;
  std::string truth;     ///< LABEL,X,Y,THETA in the units of the poses
  bool unposed = false;  ///< touches without poses get the pose 0
};

/// The recording that the tables make.
struct ImportedRecording {
  Recording recording;
  std::string assumed_units = {};  ///< as of PoseTable
  bool holds_poses = false;        ///< the table of pressures has columns of poses
  double largest_gap_s = 0.0;      ///< poses further apart in time were not interpolated
  std::size_t in_gaps = 0;         ///< frames between two poses that are further apart
  /// The largest reading where all are whole numbers, as raw ones are, but said to be in kPa.
  std::optional<double> whole_up_to = {};
  /// What was understood, or is worth saying, in sentences that begin with their file.
  std::vector<std::string> understood = {};
};

/// Reads the pressures and the poses and joins them.
/// @throws Error, naming the option and its value, or file and line or row, where the tables do not
/// make a recording
ImportedRecording import_tables(const ImportOptions& options);

/// What tables hold, of a program that has read it elsewhere.
struct ImportRows {
  PressureTable pressures;
  std::optional<PoseTable> poses;             ///< in space, in mm
  std::optional<SpatialPose> T_robot_object;  ///< true pose of the object, in space
  std::size_t elements = 0;                   ///< of a row of pressures
};
/// Throws Error where a number among the options makes no sense, or the array cannot be read:
/// before a program reads rows elsewhere, or when it knows of how many numbers its poses are.
void require_sound(const ImportOptions& options, std::size_t pose_numbers = 0);
/// As import_tables() of tables that hold this. The options' files name what the rows came from;
/// poses without times are by the clock of the frames.
/// @throws Error as import_tables(), and where the array is of other elements
ImportedRecording import_rows(const ImportOptions& options, ImportRows rows);

}  // namespace palpate
