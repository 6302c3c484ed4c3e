#include "io/pressure_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "model/stream_time.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

constexpr double unknown_number = std::numeric_limits<double>::quiet_NaN();
constexpr double before_all = -std::numeric_limits<double>::infinity();

std::optional<std::size_t> find_one_of(const CsvTable& table,
                                       std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    if (const auto found = table.find(name)) {
      return found;
    }
  }
  return {};
}

/// Returns a whole number, at least 0, in a cell of the row.
std::uint64_t count_in(const CsvTable& table, std::size_t column, std::uint64_t most,
                       const char* remedy) {
  const double number = table.require_number(column);
  if (!(number >= 0.0 && number <= static_cast<double>(most) && number == std::floor(number))) {
    table.refuse("column '{}': {} {}", printable(table.columns()[column]), number, remedy);
  }
  return static_cast<std::uint64_t>(number);
}

// Columns in the order in which they were named: p1 and p10 side by side come from names that were
// sorted as texts.
void require_counting_names(const CsvTable& table, const std::vector<std::size_t>& columns) {
  const auto split = [&](std::size_t column) {
    const std::string_view name = table.columns()[column];
    const std::size_t digits = name.find_last_not_of("0123456789") + 1;
    return std::pair{name.substr(0, digits), whole_number_of(name.substr(digits))};
  };
  for (std::size_t i = 1; i < columns.size(); ++i) {
    const auto [before, number_before] = split(columns[i - 1]);
    const auto [stem, number] = split(columns[i]);
    if (stem == before && number && number_before && *number <= *number_before) {
      table.refuse("column '{}' comes after '{}'; order the columns as the array's elements",
                   printable(table.columns()[columns[i]]),
                   printable(table.columns()[columns[i - 1]]));
    }
  }
}

/// The columns that `pressure-columns` names.
/// @param taken columns of times, poses and what else is no pressure
std::vector<std::size_t> columns_named(const CsvTable& table, const std::string& names,
                                       const std::vector<std::size_t>& taken) {
  std::vector<std::size_t> columns;
  for (std::size_t colon = names.find(':'); colon != names.npos;
       colon = names.find(':', colon + 1)) {
    const auto first = table.find(std::string_view(names).substr(0, colon));
    const auto last = table.find(std::string_view(names).substr(colon + 1));
    if (!first || !last) {
      continue;
    }
    if (*last < *first) {
      table.refuse("column '{}' comes before '{}'; give `pressure-columns FIRST:LAST`",
                   printable(table.columns()[*last]), printable(table.columns()[*first]));
    }
    for (std::size_t i = *first; i <= *last; ++i) {
      if (std::ranges::find(taken, i) != taken.end()) {
        table.refuse(
            "column '{}', between '{}' and '{}', holds no pressures; correct "
            "`pressure-columns FIRST:LAST`",
            printable(table.columns()[i]), printable(table.columns()[*first]),
            printable(table.columns()[*last]));
      }
      columns.push_back(i);
    }
    return columns;
  }
  for (std::size_t i = 0; i < table.columns().size(); ++i) {
    const std::string_view name = table.columns()[i];
    if (alike(name.substr(0, names.size()), names) && std::ranges::find(taken, i) == taken.end()) {
      columns.push_back(i);
    }
  }
  if (columns.empty()) {
    table.refuse(
        "no column is called or begins with '{}'; give `pressure-columns` a prefix of "
        "the columns' names, or FIRST:LAST",
        printable(names));
  }
  return columns;
}

/// The columns that have a name and are not taken. A column without a name is the index that pandas
/// writes.
std::vector<std::size_t> columns_left(const CsvTable& table,
                                      const std::vector<std::size_t>& taken) {
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < table.columns().size(); ++i) {
    if (!table.columns()[i].empty() && std::ranges::find(taken, i) == taken.end()) {
      left.push_back(i);
    }
  }
  return left;
}

/// Reads a table with a row for each frame.
PressureTable read_wide(CsvTable& table, std::size_t elements, const TableOptions& options) {
  std::optional<UnitColumn> time = find_time(table, options);
  if (!table.has_header() && !time && options.pressure_columns.empty() &&
      table.columns().size() == elements + 1) {
    time = UnitColumn{.index = 0, .unit = options.time_unit.value_or(time_units.front())};
  }
  const auto device_time = table.find("device_time");
  const auto lost_before = table.find("lost_before");
  const std::vector<UnitColumn> pose = find_pose(table, options);
  std::vector<std::size_t> taken;
  for (const auto& column : {device_time, lost_before}) {
    if (column) {
      taken.push_back(*column);
    }
  }
  if (time) {
    taken.push_back(time->index);
  }
  for (const UnitColumn& column : pose) {
    taken.push_back(column.index);
  }
  const std::vector<std::size_t> columns =
      options.pressure_columns.empty() ? columns_left(table, taken)
                                       : columns_named(table, options.pressure_columns, taken);
  if (columns.size() != elements) {
    const std::string span =
        columns.empty() || !table.has_header()
            ? ""
            : fmt::format(" ('{}' to '{}')", printable(table.columns()[columns.front()]),
                          printable(table.columns()[columns.back()]));
    table.refuse(
        "{} columns of pressure{} for an array of {} elements; correct `array`, or name "
        "the columns by `pressure-columns`",
        columns.size(), span, elements);
  }
  require_counting_names(table, columns);

  PressureTable all;
  all.holds_poses = !pose.empty();
  all.pressure.reserve(table.count_lines() * elements);
  double last_s = before_all;
  while (table.next()) {
    for (const std::size_t column : columns) {
      all.pressure.push_back(table.number(column).value_or(unknown_number));
    }
    if (time) {
      last_s = time_in(table, *time, last_s, false);
      all.time_s.push_back(last_s);
    }
    if (device_time) {
      all.device_time_s.push_back(table.number(*device_time).value_or(unknown_number));
    }
    if (lost_before) {
      all.lost_before.push_back(
          count_in(table, *lost_before, largest_count, "is no count of lost frames"));
    }
  }
  return all;
}

/// At least the number of runs of rows with the same cell in a column: a number may be written in
/// two ways.
std::uint64_t count_runs(const std::filesystem::path& path, std::size_t column) {
  CsvTable rows(path);
  std::string last;
  std::uint64_t runs = 0;
  while (rows.next()) {
    if (runs == 0 || rows.text(column) != last) {
      last = rows.text(column);
      ++runs;
    }
  }
  return runs;
}

double frame_in(const CsvTable& table, std::size_t column, double last) {
  const double frame = table.require_number(column);
  if (frame < last) {
    table.refuse("column '{}': {} comes after {}; sort the rows by it",
                 printable(table.columns()[column]), frame, last);
  }
  return frame;
}

/// Reads a table with a row for each reading; none where it has no columns of elements and their
/// pressures.
std::optional<PressureTable> read_long(CsvTable& table, std::size_t elements,
                                       const TableOptions& options) {
  const auto element_column = find_one_of(table, {"element", "taxel"});
  const auto pressure_column = find_one_of(table, {"pressure", "pressure_kpa", "value"});
  const auto frame_column = find_one_of(table, {"frame", "touch"});
  const auto time = find_time(table, options);
  if (!element_column || !pressure_column) {
    return {};
  }
  if (!time && !frame_column) {
    table.refuse(
        "a table with a row for each reading needs a column 'time' or 'frame'; add it, "
        "or name it by `time-column`");
  }
  PressureTable all;
  all.pressure.reserve(count_runs(table.path(), time ? time->index : *frame_column) * elements);
  const std::string remedy =
      fmt::format("is no element; the array has {}, counted from 0", elements);
  double last = before_all;
  std::vector<bool> read(elements);
  while (table.next()) {
    const double key =
        time ? time_in(table, *time, last, false) : frame_in(table, *frame_column, last);
    if (key != last) {
      all.pressure.insert(all.pressure.end(), elements, unknown_number);
      read.assign(elements, false);
      if (time) {
        all.time_s.push_back(key);
      }
      last = key;
    }
    const auto element = count_in(table, *element_column, elements - 1, remedy.c_str());
    if (read[element]) {
      table.refuse("element {} has two readings {}; leave one out", element,
                   time ? "at one time" : "in one frame");
    }
    read[element] = true;
    all.pressure[all.pressure.size() - elements + element] =
        table.number(*pressure_column).value_or(unknown_number);
  }
  return all;
}

UnitColumn find_axis(const CsvTable& table, std::size_t axis) {
  if (!table.has_header() && table.columns().size() == 2) {
    return {.index = axis, .unit = length_units.front()};
  }
  const char* const name = axis == 0 ? "x" : "y";
  const auto column = find_column(table, {name, length_units, "array"}, "", {});
  if (!column) {
    table.refuse("no column is called '{}'; write a row 'x y' in mm for each element", name);
  }
  return *column;
}

double coordinate(const CsvTable& table, const UnitColumn& column) {
  const double mm = column.unit.convert(table.require_number(column.index));
  if (std::abs(mm) > farthest_mm) {
    table.refuse("column '{}': {} mm is no place on an array; check the number",
                 printable(table.columns()[column.index]), mm);
  }
  return mm;
}

}  // namespace

PressureTable read_pressures(const std::filesystem::path& path, std::size_t elements,
                             const TableOptions& options) {
  CsvTable table(path);
  std::optional<PressureTable> pressures = read_long(table, elements, options);
  if (!pressures) {
    pressures = read_wide(table, elements, options);
  }
  if (pressures->pressure.empty()) {
    refuse(path, "holds a header and no row; write a row for each frame");
  }
  return *std::move(pressures);
}

ArrayTable read_array(const std::filesystem::path& path) {
  CsvTable table(path);
  const UnitColumn x = find_axis(table, 0);
  const UnitColumn y = find_axis(table, 1);
  const auto valid = table.find("valid");
  const auto baseline = table.find("baseline");
  ArrayTable array;
  while (table.next()) {
    array.elements_mm.emplace_back(coordinate(table, x), coordinate(table, y));
    if (valid) {
      array.valid.push_back(table.require_number(*valid) != 0.0 ? 1 : 0);
    }
    if (baseline) {
      const bool dead = valid && array.valid.back() == 0;
      array.baseline.push_back(
          dead ? table.number(*baseline).value_or(std::numeric_limits<double>::quiet_NaN())
               : table.require_number(*baseline));
    }
  }
  if (array.elements_mm.empty()) {
    refuse(path, "holds no element; write a row 'x y' in mm for each");
  }
  return array;
}

}  // namespace palpate
