#include "io/pressure_columns.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

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
      table.refuse_columns(
          "column '{}' comes after '{}'; order the columns as the array's elements",
          printable(table.columns()[columns[i]]), printable(table.columns()[columns[i - 1]]));
    }
  }
}

/// The columns of an element's three axes, by their names, which differ in one letter, x, y or z;
/// else the columns three by three.
PressureColumns axes_of(const CsvTable& table, const std::vector<std::size_t>& columns) {
  std::map<std::string, std::size_t, std::less<>> by_name;
  for (const std::size_t column : columns) {
    by_name.emplace(table.columns()[column], column);
  }
  PressureColumns named;
  for (const std::size_t column : columns) {
    std::string name = table.columns()[column];
    for (std::size_t at = 0; at < name.size(); ++at) {
      const char letter = name[at];
      if (letter != 'x' && letter != 'X') {
        continue;
      }
      std::vector<std::size_t> axes{column};
      for (const char next : {static_cast<char>(letter + 1), static_cast<char>(letter + 2)}) {
        name[at] = next;
        if (const auto found = by_name.find(name); found != by_name.end()) {
          axes.push_back(found->second);
        }
      }
      name[at] = letter;
      if (axes.size() == 3) {
        named.push_back(axes);
        break;
      }
    }
  }
  if (3 * named.size() == columns.size()) {
    return named;
  }
  PressureColumns triples;
  for (std::size_t i = 0; i + 2 < columns.size(); i += 3) {
    triples.push_back({columns[i], columns[i + 1], columns[i + 2]});
  }
  return triples;
}

}  // namespace

PressureColumns pressure_columns(const CsvTable& table, const std::vector<std::size_t>& columns,
                                 std::size_t elements, const TableOptions& options) {
  const bool has_axes = columns.size() == 3 * elements;
  if (has_axes && !options.pressure_component.empty()) {
    return axes_of(table, columns);
  }
  if (columns.size() != elements || !options.pressure_component.empty()) {
    const std::string span =
        columns.empty() || !table.has_header()
            ? ""
            : fmt::format(" ('{}' to '{}')", printable(table.columns()[columns.front()]),
                          printable(table.columns()[columns.back()]));
    table.refuse_columns(
        "{} columns of pressure{} for an array of {} elements{}", columns.size(), span, elements,
        has_axes ? "; where each element reads x, y and z, give `pressure-component z` or "
                   "`pressure-component norm`"
        : is_of_blocks(table, options)
            ? "; where each frame is a block of rows, as the array has them, give `rows frames`"
        : options.pressure_component.empty()
            ? "; correct `array`, or name the columns by `pressure-columns`"
            : "; `pressure-component` takes three columns, x, y and z, of each");
  }
  require_counting_names(table, columns);
  PressureColumns readings;
  for (const std::size_t column : columns) {
    readings.push_back({column});
  }
  return readings;
}

bool is_of_blocks(const CsvTable& table, const TableOptions& options) {
  return options.grid && (*options.grid)[1] > 1 && table.columns().size() == (*options.grid)[0];
}

double reading_in(const CsvTable& table, const std::vector<std::size_t>& axes, bool is_norm) {
  if (!is_norm) {
    return table.number(axes.back()).value_or(unknown);
  }
  double sum = 0.0;
  for (const std::size_t axis : axes) {
    const double part = table.number(axis).value_or(unknown);
    sum += part * part;
  }
  return std::sqrt(sum);
}

}  // namespace palpate
