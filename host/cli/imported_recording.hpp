#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "io/array_table.hpp"
#include "io/table_columns.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/touch.hpp"

namespace palpate::cli {

/// The flags of 'palpate import'.
struct ImportOptions {
  std::string pressures;
  std::string poses;
  std::string array;
  std::string output;
  std::string pressure_unit = "kPa";
  std::string pose_unit;
  std::string time_unit;
  std::string time_column;
  std::string pressure_columns;
  std::string pose_columns;
  std::optional<double> largest_gap_s;  ///< none: by the times of the poses
  std::optional<double> rate_hz;
  std::string rows;
  std::string object;
  std::string truth;
  bool unposed = false;  ///< touches without poses get the pose 0
};

/// The array of --array: a grid, or a file.
struct Array : ArrayTable {
  std::size_t columns = 0;  ///< 0: not a grid
  std::size_t rows = 0;
};

/// The recording that the tables make.
struct ImportedRecording {
  Recording recording;
  bool assumed_units = false;      ///< nothing said that the poses are in mm and rad
  std::array<Unit, 3> pose_units;  ///< of x, y and theta in the tables
  bool holds_poses = false;        ///< the table of pressures has columns of poses
  double largest_gap_s = 0.0;      ///< poses further apart in time were not interpolated
  std::size_t in_gaps = 0;         ///< frames between two poses that are further apart
};

/// Reads the pressures and the poses and joins them.
/// @throws Error, naming file and line or row, where the tables do not make a recording
ImportedRecording read_tables(const ImportOptions& options, const TableOptions& columns,
                              Array array);

}  // namespace palpate::cli
