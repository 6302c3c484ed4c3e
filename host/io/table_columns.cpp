#include "io/table_columns.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

constexpr Unit no_unit[] = {{""}};

// rostopic echo -p names its times %time.
constexpr Quantity time{"time timestamp stamp t %time", time_units, "time-unit"};
constexpr Quantity pose[] = {{"x", length_units, "pose-unit"},
                             {"y", length_units, "pose-unit"},
                             {"theta yaw", angle_units, "pose-unit"}};
constexpr Quantity spatial_pose[] = {
    {"tx x", length_units, "pose-unit"}, {"ty y", length_units, "pose-unit"},
    {"tz z", length_units, "pose-unit"}, {"qx", no_unit, "pose-unit"},
    {"qy", no_unit, "pose-unit"},        {"qz", no_unit, "pose-unit"},
    {"qw", no_unit, "pose-unit"}};

// The year 5138; a time in ms is larger.
constexpr double latest_s = 1e11;

/// The unit with which a column's name ends, such as "_ms".
std::optional<Unit> unit_of(std::string name, std::span<const Unit> units) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const Unit& unit : units) {
    if (name.ends_with("_" + std::string(unit.name))) {
      return unit;
    }
  }
  return {};
}

std::optional<std::size_t> find_usual(const CsvTable& table, const Quantity& quantity) {
  for (const std::string_view name : split_text(quantity.names, ' ')) {
    if (const auto found = table.find(name);
        found && (name != "t" || table.columns()[*found] == name)) {  // T is a temperature
      return found;
    }
    for (const Unit& unit : quantity.units) {
      if (const auto found = table.find(std::string(name) + "_" + std::string(unit.name))) {
        return found;
      }
    }
  }
  return {};
}

}  // namespace

std::optional<UnitColumn> find_column(const CsvTable& table, const Quantity& quantity,
                                      const std::string& name, const std::optional<Unit>& unit) {
  const auto index = name.empty() ? find_usual(table, quantity) : table.find(name);
  if (!index) {
    return {};
  }
  const std::string& found = table.columns()[*index];
  const std::optional<Unit> named = unit_of(found, quantity.units);
  if (named && unit && named->name != unit->name) {
    table.refuse("column '{}' is in {} by its name, in {} by `{}`; make them agree",
                 printable(found), named->name, unit->name, quantity.option);
  }
  return UnitColumn{.index = *index,
                    .unit = named.value_or(unit.value_or(quantity.units.front())),
                    .assumed = !named && !unit};
}

std::optional<UnitColumn> find_time(const CsvTable& table, const TableOptions& options) {
  const bool has_it = table.find(options.time_column).has_value();
  return find_column(table, time, has_it ? options.time_column : "", options.time_unit);
}

double time_in(const CsvTable& table, const UnitColumn& column, double last_s, bool later) {
  const double number = table.require_number(column.index);
  const double time_s = column.unit.convert(number);
  const std::string name = printable(table.columns()[column.index]);
  if (std::abs(time_s) > latest_s) {
    table.refuse("column '{}': {} {} is no time; give the unit by `time-unit` ms, us or ns", name,
                 number, column.unit.name);
  }
  if (time_s < last_s || (later && time_s == last_s)) {
    table.refuse("column '{}': {} s is {} the row before, at {} s; sort the rows by time", name,
                 time_s, later ? "not later than" : "earlier than", last_s);
  }
  return time_s;
}

namespace {

/// The columns of the quantities; none unless the table has all.
std::vector<UnitColumn> find_all(const CsvTable& table, std::span<const Quantity> quantities,
                                 const TableOptions& options) {
  const auto& names = options.pose_columns;
  std::vector<UnitColumn> columns;
  if (!names.empty() && names.size() != quantities.size()) {
    return columns;
  }
  for (std::size_t i = 0; i < quantities.size(); ++i) {
    const std::optional<Unit>& unit =
        quantities[i].units.data() == length_units.data()  ? options.length_unit
        : quantities[i].units.data() == angle_units.data() ? options.angle_unit
                                                           : std::optional<Unit>();
    const auto found = find_column(table, quantities[i], names.empty() ? "" : names[i], unit);
    if (!found) {
      return {};
    }
    columns.push_back(*found);
  }
  return columns;
}

}  // namespace

std::vector<UnitColumn> find_pose(const CsvTable& table, const TableOptions& options) {
  std::vector<UnitColumn> columns = find_all(table, pose, options);
  return columns.empty() ? find_all(table, spatial_pose, options) : columns;
}

}  // namespace palpate
