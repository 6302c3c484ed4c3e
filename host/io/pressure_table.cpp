#include "io/pressure_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "io/available_memory.hpp"
#include "io/table_columns.hpp"
#include "model/lost_count.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
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

/// Reserves memory for so many frames. Requires as well what a recording of them takes, and its
/// file, which is made in memory: whether each reading is valid and its float32, and three times
/// the pose and twice the time of each frame.
/// @param frames in words
void reserve(const CsvTable& table, const char* frames, std::uint64_t count, std::size_t elements,
             PressureTable& pressures) {
  constexpr std::size_t of_reading = sizeof(double) + sizeof(std::uint8_t) + sizeof(float);
  constexpr std::size_t of_frame = 3 * sizeof(Pose) + 2 * sizeof(double);
  const std::uint64_t bytes = stored_bytes(std::array{count}, elements * of_reading + of_frame);
  require_memory(table.path(),
                 fmt::format("a table of {} {} by {} elements", count, frames, elements), bytes);
  pressures.pressure.reserve(count * elements);
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

/// A table with a row for each frame.
class WideTable {
 public:
  WideTable(CsvTable& table, std::size_t elements, const TableOptions& options) : table_(table) {
    time_ = find_time(table, options);
    if (!table.has_header() && !time_ && options.pressure_columns.empty() &&
        table.columns().size() == elements + 1) {
      time_ = UnitColumn{.index = 0, .unit = options.time_unit.value_or(time_units.front())};
    }
    device_time_ = table.find("device_time");
    lost_before_ = table.find("lost_before");
    pose_ = find_pose(table, options);
    const std::vector<std::size_t> taken = columns_taken();
    columns_ = options.pressure_columns.empty()
                   ? columns_left(taken)
                   : columns_named(table, options.pressure_columns, taken);
    if (columns_.size() != elements) {
      table.refuse(
          "{} columns of pressure{} for an array of {} elements; correct `array`, or name "
          "the columns by `pressure-columns`",
          columns_.size(), span_of_names(), elements);
    }
    require_counting_names(table, columns_);
  }

  PressureTable read() {
    PressureTable all;
    all.holds_poses = !pose_.empty();
    reserve(table_, "rows", table_.count_lines(), columns_.size(), all);
    double last_s = before_all;
    while (table_.next()) {
      for (const std::size_t column : columns_) {
        all.pressure.push_back(table_.number(column).value_or(unknown));
      }
      if (time_) {
        last_s = time_in(table_, *time_, last_s, false);
        all.time_s.push_back(last_s);
      }
      if (device_time_) {
        all.device_time_s.push_back(table_.number(*device_time_).value_or(unknown));
      }
      if (lost_before_) {
        all.lost_before.push_back(
            count_in(table_, *lost_before_, largest_count, "is no count of lost frames"));
      }
    }
    return all;
  }

 private:
  std::vector<std::size_t> columns_taken() const {
    std::vector<std::size_t> taken;
    for (const auto& column : {device_time_, lost_before_}) {
      if (column) {
        taken.push_back(*column);
      }
    }
    if (time_) {
      taken.push_back(time_->index);
    }
    for (const UnitColumn& column : pose_) {
      taken.push_back(column.index);
    }
    return taken;
  }

  std::vector<std::size_t> columns_left(const std::vector<std::size_t>& taken) const {
    std::vector<std::size_t> left;
    for (std::size_t i = 0; i < table_.columns().size(); ++i) {
      // A column without a name is the index that pandas writes.
      if (!table_.columns()[i].empty() && std::ranges::find(taken, i) == taken.end()) {
        left.push_back(i);
      }
    }
    return left;
  }

  std::string span_of_names() const {
    return columns_.empty() || !table_.has_header()
               ? ""
               : fmt::format(" ('{}' to '{}')", printable(table_.columns()[columns_.front()]),
                             printable(table_.columns()[columns_.back()]));
  }

  CsvTable& table_;
  std::optional<UnitColumn> time_;
  std::optional<std::size_t> device_time_;
  std::optional<std::size_t> lost_before_;
  std::vector<UnitColumn> pose_;
  std::vector<std::size_t> columns_;  ///< [e]
};

/// A table with a row for each reading.
class LongTable {
 public:
  LongTable(CsvTable& table, std::size_t elements, const TableOptions& options)
      : table_(table), elements_(elements), time_(find_time(table, options)) {
    element_ = find_one_of(table, {"element", "taxel"});
    pressure_ = find_one_of(table, {"pressure", "pressure_kpa", "value"});
    frame_ = find_one_of(table, {"frame", "touch"});
  }

  bool is_one() const { return element_ && pressure_; }

  PressureTable read() {
    if (!time_ && !frame_) {
      table_.refuse(
          "a table with a row for each reading needs a column 'time' or 'frame'; add it, "
          "or name it by `time-column`");
    }
    PressureTable all;
    reserve(table_, time_ ? "frames, one for each time," : "frames", count_frames(), elements_,
            all);
    double last = before_all;
    std::vector<bool> read(elements_);
    while (table_.next()) {
      const double key = time_ ? time_in(table_, *time_, last, false) : frame_in(last);
      if (key != last) {
        all.pressure.insert(all.pressure.end(), elements_, unknown);
        read.assign(elements_, false);
        if (time_) {
          all.time_s.push_back(key);
        }
        last = key;
      }
      const std::string remedy =
          fmt::format("is no element; the array has {}, counted from 0", elements_);
      const auto element = count_in(table_, *element_, elements_ - 1, remedy.c_str());
      if (read[element]) {
        table_.refuse("element {} has two readings {}; leave one out", element,
                      time_ ? "at one time" : "in one frame");
      }
      read[element] = true;
      all.pressure[all.pressure.size() - elements_ + element] =
          table_.number(*pressure_).value_or(unknown);
    }
    return all;
  }

 private:
  /// At least the number of frames: a number may be written in two ways.
  std::uint64_t count_frames() const {
    const std::size_t key = time_ ? time_->index : *frame_;
    CsvTable rows(table_.path());
    std::string last;
    std::uint64_t frames = 0;
    for (bool first = true; rows.next(); first = false) {
      if (first || rows.text(key) != last) {
        last = rows.text(key);
        ++frames;
      }
    }
    return frames;
  }

  double frame_in(double last) const {
    const double frame = table_.require_number(*frame_);
    if (frame < last) {
      table_.refuse("column '{}': {} comes after {}; sort the rows by it",
                    printable(table_.columns()[*frame_]), frame, last);
    }
    return frame;
  }

  CsvTable& table_;
  std::size_t elements_;
  std::optional<UnitColumn> time_;
  std::optional<std::size_t> element_;
  std::optional<std::size_t> pressure_;
  std::optional<std::size_t> frame_;
};

constexpr std::string_view axis_names[][1] = {{"x"}, {"y"}};

UnitColumn find_axis(const CsvTable& table, std::size_t axis) {
  if (!table.has_header() && table.columns().size() == 2) {
    return {.index = axis, .unit = length_units.front()};
  }
  const auto column = find_column(table, {axis_names[axis], length_units, "array"}, "", {});
  if (!column) {
    table.refuse("no column is called '{}'; write a row 'x y' in mm for each element",
                 axis_names[axis][0]);
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
  LongTable as_long(table, elements, options);
  PressureTable pressures =
      as_long.is_one() ? as_long.read() : WideTable(table, elements, options).read();
  if (pressures.pressure.empty()) {
    refuse(path, "holds a header and no row; write a row for each frame");
  }
  return pressures;
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
