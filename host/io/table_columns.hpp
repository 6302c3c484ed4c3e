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

inline constexpr std::array<Unit, 1> no_unit{{{""}}};
// Units of the tables; the first of each list is the default.
inline constexpr std::array<Unit, 4> time_units{
    {{"s"}, {"ms", 1.0, 1e3}, {"us", 1.0, 1e6}, {"ns", 1.0, 1e9}}};
inline constexpr std::array<Unit, 2> length_units{{{"mm"}, {"m", 1e3, 1.0}}};
inline constexpr std::array<Unit, 2> angle_units{{{"rad"}, {"deg", std::numbers::pi, 180.0}}};

/// What the options say about the columns, rows and units of tables; "" where one is not given.
struct TableOptions {
  /// Of the table (of an import: of the pressures), from 1; 0: found; none: no option gives it.
  std::optional<std::uint64_t> header_line = 0;
  /// COLUMN=VALUE: of a table with this column, only rows with this value.
  std::vector<std::string> where;
  std::string time_column;       ///< "": the usual names
  std::string pressure_columns;  ///< see choose_columns(); "": all that are left
  /// Of elements that read three axes: "z", or "norm", the length of the vector.
  std::string pressure_component;
  std::string pose_columns;    ///< see choose_columns(); "": the usual names
  bool may_name_poses = true;  ///< set by the caller: there is an option `pose-columns`
  /// Axes about which three angles turn one after another: "xyz" fixed ones, "ZYX" moving ones, as
  /// SciPy has them; "vector": they are a rotation vector; "": roll, pitch and yaw about xyz.
  std::string euler;
  std::string matrix;     ///< how a matrix is written: "columns" or "rows"; "": found
  std::string time_unit;  ///< "s", "ms", "us" or "ns"; "": by the column's name, else s
  std::string pose_unit;  ///< such as "m,deg"; "": by the columns' names, else mm and rad
  /// Set by import_tables(): the table is that of the poses or of the pressures.
  bool is_one_of_two = false;
  /// Set by import_tables(): of poses in their own table, beside frames that have times.
  bool needs_times = false;
  /// Set by import_tables(): columns and rows of the array.
  std::optional<std::array<std::size_t, 2>> grid = {};
  /// Set by import_tables(): each frame may be a block of rows, as the array has them.
  bool has_blocks = false;
  /// Set by import_tables(): rows of one time are all kept.
  bool keeps_repeated = false;
};

/// @throws Error naming the option whose value makes no sense
void validate(const TableOptions& options);

/// The one of these units that the options give for times, lengths or angles; none where they give
/// none.
std::optional<Unit> given_unit(const TableOptions& options, std::span<const Unit> units);

/// `where` as pairs of a column and the value that its cells must have; call validate() first.
std::vector<std::pair<std::string, std::string>> conditions(const TableOptions& options);

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

/// The column of this index with its unit: by its name, else by the options, else the first of
/// `units`.
/// @throws Error where the column's name and the options differ
UnitColumn unit_column(const CsvTable& table, std::size_t index, std::span<const Unit> units,
                       const TableOptions& options);

/// Which columns of a pose are taken to be in which units, "poses taken to be in mm and rad"; ""
/// where names or options give them all.
std::string assumed_words(const CsvTable& table, std::span<const UnitColumn> columns);

/// Finds the column of one of these names, which are separated by blanks. A name may end with its
/// unit, such as time_ms, time [ms] or time (ms). None where there is no such column.
/// @throws Error as unit_column()
std::optional<UnitColumn> find_column(const CsvTable& table, std::string_view names,
                                      std::span<const Unit> units, const TableOptions& options);

/// Finds the column of times: `options.time_column` where the table has it, else a usual name.
std::optional<UnitColumn> find_time(const CsvTable& table, const TableOptions& options);

/// How the columns of a pose tell it: x, y and an angle in the plane, or a position in space and a
/// rotation.
enum class PoseForm { planar, quaternion, euler, rotation_vector, matrix };

/// True where the last three numbers are angles or a rotation vector.
bool is_of_angles(PoseForm form);
/// The form of a pose of so many numbers, euler for both forms of six; none of another number.
std::optional<PoseForm> form_of(std::size_t numbers);
/// The unit of each number by the options, else the first of its units.
std::vector<Unit> units_of(PoseForm form, const TableOptions& options);
inline constexpr std::string_view forms_of_poses =
    "give three, X,Y,THETA, or of poses in space six (X,Y,Z,ROLL,PITCH,YAW, or a rotation vector), "
    "seven (TX,TY,TZ,QX,QY,QZ,QW), or the 12 or 16 numbers of a matrix";

struct PoseColumns {
  PoseForm form = PoseForm::planar;
  std::vector<UnitColumn> columns;  ///< in the order of the form
};

/// The columns of these indices as a pose of this form. @throws Error as unit_column()
PoseColumns pose_columns(const CsvTable& table, PoseForm form,
                         const std::vector<std::size_t>& indices, const TableOptions& options);

/// Finds the columns of poses that the options name, or else that have the usual names of one form;
/// no columns where there are none.
/// @throws Error where the options name so many that they are no pose
PoseColumns find_pose(const CsvTable& table, const TableOptions& options);

struct TimedPoseColumns {
  std::optional<UnitColumn> time;
  PoseColumns pose;
};
/// The times, and as find_pose() the poses, of a table of poses, which may have no names.
/// @throws Error where the table has no pose
TimedPoseColumns find_columns(const CsvTable& table, const TableOptions& options);

/// The columns that a text names, in its order: names, or numbers counted from 1; FIRST:LAST;
/// START::STEP, every STEP-th from START on; patterns in which `*` is any text and `{n}` a number,
/// by which the columns are ordered; and beginnings of names. Commas separate them.
/// @param taken columns that hold something else, which FIRST:LAST may not cross
/// @param option that gives the text, for messages: "pressure-columns"
/// @throws Error where a part names no column, or one twice
std::vector<std::size_t> choose_columns(const CsvTable& table, const std::string& text,
                                        const std::vector<std::size_t>& taken, const char* option);

/// For each element the columns of the axes of which its reading is made: one, or x, y and z.
using PressureColumns = std::vector<std::vector<std::size_t>>;

/// The columns of each element among those of the pressures.
/// @throws Error where they are more or fewer than the elements, or not in their order
PressureColumns pressure_columns(const CsvTable& table, const std::vector<std::size_t>& columns,
                                 std::size_t elements, const TableOptions& options);

/// True where the rows are as wide as the array's grid.
bool is_of_blocks(const CsvTable& table, const TableOptions& options);

/// The reading of the row in the columns of an element, NaN where it is unknown: of the last axis,
/// or the length of the vector.
double reading_in(const CsvTable& table, const std::vector<std::size_t>& axes, bool is_norm);

/// A row at which the clock of a table steps back.
struct ClockStep {
  std::size_t row = 0;     ///< the first of the new stretch, of those that are read
  std::uint64_t line = 0;  ///< of the file
  double from_s = 0.0;
  double to_s = 0.0;
};

/// The year 5138: no time in s is later; one in ms is.
inline constexpr double latest_time_s = 1e11;

/// Reads the times of a table's rows, in numbers or as clocks write them.
class TableTimes {
 public:
  TableTimes(const CsvTable& table, const UnitColumn& column) : table_(table), column_(column) {}

  /// Returns the row's time in seconds, and notes where it is earlier than that of the row before.
  /// Times of day go on after midnight.
  /// @param row of those that are read
  /// @throws Error where the cell holds no time
  double next(std::size_t row);

  std::vector<ClockStep> steps;

 private:
  const CsvTable& table_;
  UnitColumn column_;
  double last_s_ = 0.0;
  double days_s_ = 0.0;  ///< of times of day, since the first row
  bool first_ = true;
};

}  // namespace palpate
