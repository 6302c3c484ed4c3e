#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/csv_table.hpp"

namespace palpate {

/// A unit of a column: a number in it, times `multiplier` / `divisor`, is in the unit of
/// recordings.
struct Unit {
  std::string_view name;
  double multiplier = 1.0;
  double divisor = 1.0;

  double convert(double number) const { return number * multiplier / divisor; }
};

// Units of the tables; the first of each list is the default.
inline constexpr std::array<Unit, 4> time_units{
    {{"s"}, {"ms", 1.0, 1e3}, {"us", 1.0, 1e6}, {"ns", 1.0, 1e9}}};
inline constexpr std::array<Unit, 2> length_units{{{"mm"}, {"m", 1e3, 1.0}}};
inline constexpr std::array<Unit, 2> angle_units{{{"rad"}, {"deg", std::numbers::pi, 180.0}}};

/// What the options say about the columns, rows and units of tables.
struct TableOptions {
  std::uint64_t header_line = 0;  ///< of the table, from 1; 0: found
  /// Columns and what their cells must be, where a table has the column.
  std::vector<std::pair<std::string, std::string>> where = {};
  std::string time_column;       ///< "": the usual names
  std::string pressure_columns;  ///< see choose_columns(); "": all that are left
  /// Of elements that read three axes: "z", or "norm", the length of the vector; "": of one.
  std::string pressure_component = {};
  std::string pose_columns = {};  ///< see choose_columns(); "": the usual names
  bool may_name_poses = true;     ///< there is an option `pose-columns`
  /// Axes about which three angles turn one after another: "xyz" fixed ones, "ZYX" moving ones, as
  /// SciPy has them; "vector": they are a rotation vector; "": roll, pitch and yaw about xyz.
  std::string euler = {};
  std::string matrix = {};          ///< how a matrix is written: "columns" or "rows"; "": found
  std::optional<Unit> time_unit;    ///< none: by the column's name, else s
  std::optional<Unit> length_unit;  ///< none: by the column's name, else mm
  std::optional<Unit> angle_unit;   ///< none: by the column's name, else rad
  std::optional<std::array<std::size_t, 2>> grid = {};  ///< columns and rows of the array
  bool has_blocks = false;  ///< each frame may be a block of rows, as the array has them
};

/// Opens a table with the options' header line, and passes over the rows that `where` leaves out.
CsvTable open_table(const std::filesystem::path& path, const TableOptions& options);

/// What to say of lines before a table's header or first row, in a sentence.
std::string skipped_words(const CsvTable& table);

/// A column whose unit is known.
struct UnitColumn {
  std::size_t index = 0;
  Unit unit;
  bool assumed = false;  ///< neither the name nor an option gives the unit
};

/// A quantity that columns hold, with its usual names and its units.
struct Quantity {
  std::string_view names;  ///< separated by blanks
  std::span<const Unit> units;
  const char* option;  ///< that gives its unit
};

/// Finds the column of this name or, where it is "", of a usual name. A name may end with its unit,
/// such as time_ms, time [ms] or time (ms). None where there is no such column.
/// @throws Error where the column's name and `unit` differ
std::optional<UnitColumn> find_column(const CsvTable& table, const Quantity& quantity,
                                      const std::string& name, const std::optional<Unit>& unit);

/// Finds the column of times: `options.time_column` where the table has it, else a usual name.
std::optional<UnitColumn> find_time(const CsvTable& table, const TableOptions& options);

/// How the columns of a pose tell it: x, y and an angle in the plane, or a position in space and a
/// rotation.
enum class PoseForm { planar, quaternion, euler, rotation_vector, matrix };

struct PoseColumns {
  PoseForm form = PoseForm::planar;
  std::vector<UnitColumn> columns;  ///< in the order of the form
  bool are_usual = true;            ///< x, y, theta, or a quaternion: nothing needs to be said
};

/// Finds the columns of poses that the options name, or else that have the usual names of one form;
/// no columns where there are none.
/// @throws Error where the options name so many that they are no pose
PoseColumns find_pose(const CsvTable& table, const TableOptions& options);

}  // namespace palpate
