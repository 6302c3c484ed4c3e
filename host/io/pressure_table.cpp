#include "io/pressure_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "model/stream_time.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

constexpr double unknown_number = std::numeric_limits<double>::quiet_NaN();
constexpr double before_all = -std::numeric_limits<double>::infinity();
constexpr Unit pressure_units[] = {{"kPa"}};

/// Returns a whole number, at least 0, in a cell of the row.
std::uint64_t count_in(const CsvTable& table, std::size_t column, std::uint64_t limit,
                       const char* remedy) {
  const double number = table.require_number(column);
  if (!(number >= 0.0 && number <= static_cast<double>(limit) && number == std::floor(number))) {
    table.refuse("column '{}': {} {}", printable(table.columns()[column]), number, remedy);
  }
  return static_cast<std::uint64_t>(number);
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
    time = unit_column(table, 0, time_units, options);
  }
  const auto device_time = table.find("device_time");
  const auto lost_before = table.find("lost_before");
  const std::vector<UnitColumn> pose = find_pose(table, options).columns;
  std::vector<std::size_t> taken;
  const auto take = [&](const std::optional<std::size_t>& column) {
    taken.insert(taken.end(), column ? 1 : 0, column.value_or(0));
  };
  take(device_time);
  take(lost_before);
  take(time ? std::optional(time->index) : std::nullopt);
  for (const UnitColumn& column : pose) {
    take(column.index);
  }
  for (const auto& [name, value] : conditions(options)) {
    take(table.find_or_count(name));
  }
  const std::vector<std::size_t> columns =
      options.pressure_columns.empty()
          ? columns_left(table, taken)
          : choose_columns(table, options.pressure_columns, taken, "pressure-columns");
  const PressureColumns readings = pressure_columns(table, columns, elements, options);
  const bool is_norm = options.pressure_component == "norm";

  PressureTable all;
  if (!options.pressure_component.empty()) {
    const auto name = [&](std::size_t axis) {
      return printable(table.columns()[readings.front()[axis]]);
    };
    all.understood.push_back(fmt::format(
        "its readings are {} of x, y and z of each element, of the first '{}', '{}' and '{}'",
        is_norm ? "the length" : "the z", name(0), name(1), name(2)));
  } else if (options.pressure_columns.find_first_of("*{") != std::string::npos ||
             options.pressure_columns.find("::") != std::string::npos) {
    all.understood.push_back(fmt::format(
        "its readings are {} columns, '{}' to '{}'", columns.size(),
        printable(table.columns()[columns.front()]), printable(table.columns()[columns.back()])));
  }
  all.holds_poses = !pose.empty();
  all.pressure.reserve(table.count_lines() * elements);
  TableTimes times(table, time.value_or(UnitColumn()));
  std::size_t repeated = 0;
  while (table.next()) {
    if (time) {
      const double time_s = times.next(all.time_s.size());
      if (!options.keeps_repeated && !all.time_s.empty() && time_s == all.time_s.back()) {
        ++repeated;
        continue;
      }
      all.time_s.push_back(time_s);
    }
    for (const std::vector<std::size_t>& axes : readings) {
      all.pressure.push_back(reading_in(table, axes, is_norm));
    }
    if (device_time) {
      all.device_time_s.push_back(table.number(*device_time).value_or(unknown_number));
    }
    if (lost_before) {
      all.lost_before.push_back(
          count_in(table, *lost_before, largest_count, "is no count of lost frames"));
    }
  }
  if (repeated > 0) {
    all.understood.push_back(fmt::format(
        "{} of its rows repeat the time of the row before, whose readings are kept", repeated));
  }
  all.steps = std::move(times.steps);
  return all;
}

/// Reads frames that are blocks of so many rows.
PressureTable read_blocks(CsvTable& table, const TableOptions& options) {
  if (!options.pressure_columns.empty() || !options.where.empty()) {
    table.refuse_columns("its frames are blocks of rows, which are read whole; leave out `{}`",
                         options.where.empty() ? "pressure-columns" : "where");
  }
  const std::size_t rows = (*options.grid)[1];
  PressureTable all;
  bool passed = false;
  std::size_t row = 0;
  std::uint64_t between = 0;
  while (table.next_numbers(passed)) {
    between += passed ? 1 : 0;
    if (passed && row > 0) {
      table.refuse("a frame ends after {} rows, and the array has {}; correct `array`", row, rows);
    }
    for (std::size_t i = 0; i < table.columns().size(); ++i) {
      all.pressure.push_back(table.number(i).value_or(unknown_number));
    }
    row = (row + 1) % rows;
  }
  if (row > 0) {
    table.refuse(
        "the last frame has {} rows, and the array has {}; correct `array`, or complete it", row,
        rows);
  }
  all.understood.push_back(
      fmt::format("its frames are blocks of {} rows of {} readings", rows, table.columns().size()));
  return all;
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
  const auto element_column = find_column(table, "element taxel", no_unit, options);
  auto pressure_column = find_column(table, "pressure value", pressure_units, options);
  if (element_column && !options.pressure_columns.empty()) {
    const auto chosen = choose_columns(table, options.pressure_columns, {element_column->index},
                                       "pressure-columns");
    pressure_column =
        chosen.size() == 1 ? std::optional(UnitColumn{.index = chosen.front()}) : std::nullopt;
  }
  if (!element_column || !pressure_column) {
    return {};
  }
  if (!options.pressure_component.empty()) {
    table.refuse_columns("`pressure-component {}`: each row holds one reading; leave it out",
                         options.pressure_component);
  }
  const auto time = find_time(table, options);
  // A touch may last for many frames.
  const auto frame_column = find_column(table, time ? "frame" : "frame touch", no_unit, options);
  if (!time && !frame_column) {
    table.refuse_columns(
        "a table with a row for each reading needs a column 'time' or 'frame'; add it, "
        "or name it by `time-column`");
  }
  PressureTable all;
  all.is_long = true;
  if (options.where.empty()) {
    // At least as many readings as rows; the vector grows where frames lack elements.
    all.pressure.reserve(table.count_lines());
  }
  const std::string remedy =
      fmt::format("is no element; the array has {}, counted from 0", elements);
  double last = before_all;
  std::vector<bool> read(elements);
  TableTimes times(table, time.value_or(UnitColumn()));
  while (table.next()) {
    const double key = frame_column ? frame_in(table, frame_column->index, time ? before_all : last)
                                    : times.next(all.time_s.size());
    if (key != last) {
      all.pressure.insert(all.pressure.end(), elements, unknown_number);
      read.assign(elements, false);
      if (time) {
        all.time_s.push_back(frame_column ? times.next(all.time_s.size()) : key);
      }
      last = key;
    }
    const auto element = count_in(table, element_column->index, elements - 1, remedy.c_str());
    if (read[element]) {
      table.refuse("element {} has two readings {}; leave one out", element,
                   frame_column ? "in one frame" : "at one time");
    }
    read[element] = true;
    all.pressure[all.pressure.size() - elements + element] =
        table.number(pressure_column->index).value_or(unknown_number);
  }
  all.steps = std::move(times.steps);
  return all;
}

UnitColumn find_axis(const CsvTable& table, std::size_t axis) {
  if (!table.has_header() && table.columns().size() == 2) {
    return {.index = axis, .unit = length_units.front()};
  }
  const char* const name = axis == 0 ? "x" : "y";
  const auto column = find_column(table, name, length_units, {});
  if (!column) {
    table.refuse_columns("no column is called '{}'; write a row 'x y' in mm for each element",
                         name);
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
  CsvTable table = open_table(path, options);
  std::optional<PressureTable> pressures = read_long(table, elements, options);
  if (!pressures && options.has_blocks && is_of_blocks(table, options)) {
    pressures = read_blocks(table, options);
  }
  pressures = pressures ? std::move(pressures) : read_wide(table, elements, options);
  if (table.skipped_lines() > 0) {
    pressures->understood.insert(pressures->understood.begin(),
                                 skipped_words(table) + " (`header-line`)");
  }
  if (pressures->pressure.empty()) {
    refuse(path, "holds a header and no row; write a row for each frame");
  }
  return *std::move(pressures);
}

Recording read_array(const std::filesystem::path& path) {
  CsvTable table(path);
  const UnitColumn x = find_axis(table, 0);
  const UnitColumn y = find_axis(table, 1);
  const auto valid = table.find("valid");
  const auto baseline = table.find("baseline");
  Recording array;
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
