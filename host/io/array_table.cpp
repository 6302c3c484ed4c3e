#include "io/array_table.hpp"

#include <cmath>
#include <limits>

#include "io/table_columns.hpp"
#include "model/printable.hpp"
#include "palpate/pose.hpp"

namespace palpate {

namespace {

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
