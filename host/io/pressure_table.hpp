#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "io/table_columns.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Readings of an array, row by row.
struct PressureTable {
  std::vector<double> pressure;            ///< [n, e]; NaN where a cell is empty
  std::vector<double> time_s;              ///< [n], or empty
  std::vector<double> device_time_s;       ///< [n], or empty
  std::vector<std::uint64_t> lost_before;  ///< [n], or empty
  bool is_long = false;                    ///< its rows are single readings
  bool holds_poses = false;           ///< a wide table has columns of poses beside the readings
  std::vector<ClockStep> steps = {};  ///< where the clock steps back
  std::vector<std::string> understood = {};  ///< what was not plain, in sentences
};

/// Reads pressures from a CSV file.
///
/// Wide: a row for each frame and a column for each element, in the order of the elements, or three
/// where each element reads three axes and `options` says what of them is the pressure. The columns
/// are those that `options` names, or, in a table with a header, all columns that have a name and
/// hold neither times, nor poses, nor `device_time`, nor `lost_before`. A table without a header
/// holds the pressures, and before them the times where it has one column more than elements. Of
/// rows of one time the first is kept, unless `options` says otherwise.
///
/// Long: a row for each reading, in a table with the columns `element` (or taxel, counted from 0)
/// and `pressure` (or value, or the one that `options` names), and `time` or `frame`, which is the
/// same in all readings of a frame: the frame where a table has both.
///
/// Blocks: where `options` says so, each frame is a block of rows as the array has them, and other
/// lines, such as "Frame 12", stand between the blocks.
///
/// @param elements of the array, e
/// @throws Error, naming file, line and column, where a row does not fit
PressureTable read_pressures(const std::filesystem::path& path, std::size_t elements,
                             const TableOptions& options);

/// Reads an array from a CSV file with a row for each element and the columns x and y (in mm, or in
/// m where they are called x_m and y_m) and, where they are known, valid and baseline. A table
/// without a header holds x and y.
/// @returns `elements_mm`, `valid` and `baseline` alone
/// @throws Error naming file, line and column
Recording read_array(const std::filesystem::path& path);

}  // namespace palpate
