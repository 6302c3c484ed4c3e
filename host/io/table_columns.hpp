#pragma once

#include <array>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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

/// What the options say about the columns and units of tables.
struct TableOptions {
  std::string time_column;       ///< "": the usual names
  std::string pressure_columns;  ///< prefix or FIRST:LAST; "": all that are left
  /// Names of the columns of x, y and theta, or of x, y, z and a quaternion's x, y, z and w; none:
  /// the usual names.
  std::vector<std::string> pose_columns = {};
  bool may_name_poses = true;       ///< there is an option `pose-columns`
  std::optional<Unit> time_unit;    ///< none: by the column's name, else s
  std::optional<Unit> length_unit;  ///< none: by the column's name, else mm
  std::optional<Unit> angle_unit;   ///< none: by the column's name, else rad
};

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
/// such as time_ms. None where there is no such column.
/// @throws Error where the column's name and `unit` differ
std::optional<UnitColumn> find_column(const CsvTable& table, const Quantity& quantity,
                                      const std::string& name, const std::optional<Unit>& unit);

/// Finds the column of times: `options.time_column` where the table has it, else a usual name.
std::optional<UnitColumn> find_time(const CsvTable& table, const TableOptions& options);
/// Returns the row's time in seconds.
/// @throws Error where the cell holds no time, or one before `last_s`, or at `last_s` where
/// `later` is asked for
double time_in(const CsvTable& table, const UnitColumn& column, double last_s, bool later);

/// Finds the columns of x, y and theta, or else of x, y, z and a quaternion's x, y, z and w; none
/// unless the table has all three, or all seven.
std::vector<UnitColumn> find_pose(const CsvTable& table, const TableOptions& options);

}  // namespace palpate
