#include "io/table_columns.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <set>

#include <fmt/ranges.h>

#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

/// A quantity that columns hold, with its usual names, separated by blanks, and its units.
struct Quantity {
  std::string_view names;
  std::span<const Unit> units;
};

// rostopic echo -p names its times %time.
constexpr std::string_view names_of_time = "time timestamp stamp t %time";
constexpr Quantity position[] = {
    {"tx x position.x pose.position.x field.pose.position.x", length_units},
    {"ty y position.y pose.position.y field.pose.position.y", length_units},
    {"tz z position.z pose.position.z field.pose.position.z", length_units}};

/// What the numbers of a pose are; a matrix has no usual names, and its position is a length.
std::vector<Quantity> quantities_of(PoseForm form) {
  std::vector<Quantity> all(std::begin(position), std::end(position));
  const auto add = [&](std::initializer_list<Quantity> rotation) {
    all.insert(all.end(), rotation);
    return all;
  };
  switch (form) {
    case PoseForm::planar:
      return {{"x", length_units}, {"y", length_units}, {"theta yaw", angle_units}};
    case PoseForm::quaternion:
      return add({{"qx orientation.x pose.orientation.x field.pose.orientation.x", no_unit},
                  {"qy orientation.y pose.orientation.y field.pose.orientation.y", no_unit},
                  {"qz orientation.z pose.orientation.z field.pose.orientation.z", no_unit},
                  {"qw orientation.w pose.orientation.w field.pose.orientation.w", no_unit}});
    case PoseForm::euler:
      return add({{"roll", angle_units}, {"pitch", angle_units}, {"yaw", angle_units}});
    case PoseForm::rotation_vector:
      return add({{"rx", angle_units}, {"ry", angle_units}, {"rz", angle_units}});
    case PoseForm::matrix:
      break;
  }
  return std::vector<Quantity>(16, position[0]);
}

/// Units that tables may have, and that are not read.
constexpr Unit other_units[] = {{"cm"}, {"um"}, {"in"}, {"inch"}, {"min"}, {"h"}, {"mrad"}};

/// Names of units that stand for the units above.
constexpr std::pair<std::string_view, std::string_view> spellings[] = {
    {"sec", "s"},   {"seconds", "s"},   {"msec", "ms"},     {"µs", "us"},
    {"μs", "us"},   {"usec", "us"},     {"degrees", "deg"}, {"°", "deg"},
    {"nsec", "ns"}, {"radians", "rad"}, {"metres", "m"},    {"meters", "m"}};

/// A column's name without its unit, and the unit: of "time_ms", "time [ms]" and "time (ms)".
struct NameParts {
  std::string_view stem;
  std::optional<Unit> unit;
};

NameParts parts_of(std::string_view name, std::span<const Unit> units) {
  const auto unit_called = [&](std::string_view text) -> std::optional<Unit> {
    for (const auto& [spelling, usual] : spellings) {
      text = alike(text, spelling) ? usual : text;
    }
    const auto found =
        std::ranges::find_if(units, [&](const Unit& unit) { return alike(unit.name, text); });
    return found == units.end() || text.empty() ? std::nullopt : std::optional(*found);
  };
  for (const char* brackets : {"[]", "()"}) {
    const std::size_t open = name.rfind(brackets[0]);
    if (open != name.npos && open > 0 && name.back() == brackets[1]) {
      const auto unit = unit_called(trimmed(name.substr(open + 1, name.size() - open - 2)));
      if (unit) {
        return {trimmed(name.substr(0, open)), unit};
      }
    }
  }
  const std::size_t line = name.rfind('_');
  const auto unit = line == name.npos ? std::nullopt : unit_called(name.substr(line + 1));
  return unit ? NameParts{name.substr(0, line), unit} : NameParts{name, {}};
}

// Universal Robots' RTDE and libfranka name the parts of a pose by a stem and numbers from 0 on,
// and log them in metres and radians.
constexpr std::string_view universal_robots = "actual_TCP_pose";
constexpr std::string_view libfranka = "O_T_EE";

bool begins_with(std::string_view name, std::string_view stem) {
  return alike(name.substr(0, stem.size()), stem);
}

/// The columns whose names are `stem` and so many numbers from 0 on.
std::vector<std::size_t> counted_columns(const CsvTable& table, std::string_view stem,
                                         std::size_t count) {
  std::vector<std::size_t> columns;
  for (std::size_t i = 0; i < count; ++i) {
    std::optional<std::size_t> found;
    for (const char* form : {"{}_{}", "{}[{}]", "{}{}", "{}.{}"}) {
      found = found ? found : table.find(fmt::format(fmt::runtime(form), stem, i));
    }
    if (!found) {
      return {};
    }
    columns.push_back(*found);
  }
  return columns;
}

/// The columns that have the usual names of one form; none unless the table has all.
PoseColumns usual_pose(const CsvTable& table, const TableOptions& options) {
  for (const PoseForm form :
       {PoseForm::euler, PoseForm::planar, PoseForm::quaternion, PoseForm::rotation_vector}) {
    const std::vector<Quantity> quantities = quantities_of(form);
    PoseColumns pose{form, {}};
    for (const Quantity& quantity : quantities) {
      if (const auto column = find_column(table, quantity.names, quantity.units, options)) {
        pose.columns.push_back(*column);
      }
    }
    if (pose.columns.size() == quantities.size()) {
      return pose;
    }
  }
  if (const auto columns = counted_columns(table, universal_robots, 6); !columns.empty()) {
    return pose_columns(table, PoseForm::rotation_vector, columns, options);
  }
  return pose_columns(table, PoseForm::matrix, counted_columns(table, libfranka, 16), options);
}

PoseColumns named_pose(const CsvTable& table, const TableOptions& options) {
  const auto time = find_time(table, options);
  const std::vector<std::size_t> taken(time ? 1 : 0, time ? time->index : 0);
  const std::vector<std::size_t> chosen =
      choose_columns(table, options.pose_columns, taken, "pose-columns");
  const std::optional<PoseForm> found = form_of(chosen.size());
  if (!found) {
    table.refuse_columns("`pose-columns {}` names {} columns; {}", options.pose_columns,
                         chosen.size(), forms_of_poses);
  }
  PoseForm form = *found;
  if (form == PoseForm::euler) {
    // UR's names and rx, ry, rz say what they are; other angles are roll, pitch and yaw.
    const std::string_view name = table.columns()[chosen[3]];
    const bool is_vector =
        alike(parts_of(name, angle_units).stem, "rx") || begins_with(name, universal_robots);
    form = is_vector ? PoseForm::rotation_vector : form;
  }
  return pose_columns(table, form, chosen, options);
}

/// Orders the columns of a rotation as these endings of their names; false where two endings are
/// alike or one is missing.
bool order_by_endings(const CsvTable& table, const std::vector<std::string_view>& endings,
                      PoseColumns& pose) {
  const auto columns = std::span(pose.columns).last(endings.size());
  std::vector<UnitColumn> ordered;
  for (const std::string_view ending : endings) {
    const auto found = std::ranges::find_if(columns, [&](const UnitColumn& column) {
      const std::string_view stem = parts_of(table.columns()[column.index], angle_units).stem;
      return alike(stem.substr(stem.size() - std::min(stem.size(), ending.size())), ending);
    });
    if (found == columns.end() || endings.front() == endings.back()) {
      return false;
    }
    ordered.push_back(*found);
  }
  std::ranges::copy(ordered, columns.begin());
  return true;
}

/// True for three axes of x, y and z in lower case (fixed) or in upper case (moving), none of which
/// follows itself.
bool are_axes(std::string_view axes) {
  const auto all_of = [&](std::string_view letters) {
    return axes.find_first_not_of(letters) == axes.npos;
  };
  return axes.size() == 3 && (all_of("xyz") || all_of("XYZ")) && axes[0] != axes[1] &&
         axes[1] != axes[2];
}

}  // namespace

bool is_of_angles(PoseForm form) {
  return form == PoseForm::euler || form == PoseForm::rotation_vector;
}

std::vector<Unit> units_of(PoseForm form, const TableOptions& options) {
  std::vector<Unit> units;
  for (const Quantity& quantity : quantities_of(form)) {
    units.push_back(given_unit(options, quantity.units).value_or(quantity.units.front()));
  }
  return units;
}

std::optional<PoseForm> form_of(std::size_t numbers) {
  constexpr std::pair<std::size_t, PoseForm> forms[] = {{3, PoseForm::planar},
                                                        {6, PoseForm::euler},
                                                        {7, PoseForm::quaternion},
                                                        {12, PoseForm::matrix},
                                                        {16, PoseForm::matrix}};
  const auto found = std::ranges::find(forms, numbers, &std::pair<std::size_t, PoseForm>::first);
  return found == std::end(forms) ? std::nullopt : std::optional(found->second);
}

void validate(const TableOptions& options) {
  const auto require_one_of = [](const char* option, const std::string& value,
                                 std::initializer_list<const char*> values) {
    if (!value.empty() && std::ranges::find(values, value) == values.end()) {
      refuse(fmt::format("`{} {}`", option, value), "give {}",
             fmt::format("{}", fmt::join(values, " or ")));
    }
  };
  require_one_of("time-unit", options.time_unit, {"s", "ms", "us", "ns"});
  require_one_of("pose-unit", options.pose_unit, {"mm,rad", "mm,deg", "m,rad", "m,deg"});
  for (const std::string& where : options.where) {
    if (const std::size_t equals = where.find('='); equals == where.npos || equals == 0) {
      refuse(fmt::format("`where {}`", where), "give COLUMN=VALUE");
    }
  }
  require_one_of("pressure-component", options.pressure_component, {"z", "norm"});
  require_one_of("matrix", options.matrix, {"columns", "rows"});
  if (!options.euler.empty() && options.euler != "vector" && !are_axes(options.euler)) {
    refuse(fmt::format("`euler {}`", options.euler),
           "give the axes of the three angles in their order, xyz, zyx and so on about fixed axes, "
           "XYZ, ZYX and so on about moving ones, or vector for a rotation vector");
  }
}

std::optional<Unit> given_unit(const TableOptions& options, std::span<const Unit> units) {
  std::vector<std::string_view> names = split_text(options.pose_unit, ',');
  names.emplace_back(options.time_unit);
  const auto found = std::ranges::find_if(units, [&](const Unit& unit) {
    return !unit.name.empty() && std::ranges::find(names, unit.name) != names.end();
  });
  return found == units.end() ? std::nullopt : std::optional(*found);
}

std::vector<std::pair<std::string, std::string>> conditions(const TableOptions& options) {
  std::vector<std::pair<std::string, std::string>> conditions;
  for (const std::string& where : options.where) {
    const std::size_t equals = where.find('=');
    conditions.emplace_back(where.substr(0, equals), where.substr(equals + 1));
  }
  return conditions;
}

CsvTable open_table(const std::filesystem::path& path, const TableOptions& options) {
  CsvTable table(path, options.header_line);
  for (const auto& [name, value] : conditions(options)) {
    if (const auto column = table.find_or_count(name)) {
      table.keep_where(*column, value);
    }
  }
  return table;
}

std::string skipped_words(const CsvTable& table) {
  const std::uint64_t lines = table.skipped_lines();
  return fmt::format("{} before line {} ({}) {} left out",
                     lines == 1 ? "the line" : fmt::format("{} lines", lines),
                     table.header_number(), table.header_words(), lines == 1 ? "is" : "are");
}

UnitColumn unit_column(const CsvTable& table, std::size_t index, std::span<const Unit> units,
                       const TableOptions& options) {
  const std::string& name = table.columns()[index];
  const std::optional<Unit> named = parts_of(name, units).unit;
  const std::optional<Unit> given = given_unit(options, units);
  const bool is_time = units.data() == time_units.data();
  const char* const option = is_time ? "time-unit" : "pose-unit";
  // With two tables, the unit of times may be meant for the other one.
  if (named && given && named->name != given->name && !(is_time && options.is_one_of_two)) {
    table.refuse_columns("column '{}' is in {} by its name, in {} by `{}`; make them agree",
                         printable(name), named->name, given->name, option);
  }
  const bool is_robots = begins_with(name, universal_robots) || begins_with(name, libfranka);
  const bool in_m = is_robots && units.data() == length_units.data();
  const bool is_assumed = !named && !given && !is_robots && units.size() > 1;
  if (const auto other = parts_of(name, other_units).unit; is_assumed && other) {
    table.refuse_columns("column '{}' is in {} by its name; convert it to {}, or give `{}`",
                         printable(name), other->name, units.front().name, option);
  }
  return {.index = index,
          .unit = named.value_or(given.value_or(in_m ? length_units[1] : units.front())),
          .assumed = is_assumed};
}

std::string assumed_words(const CsvTable& table, std::span<const UnitColumn> columns) {
  std::vector<std::string> names;
  std::set<std::string_view> units;
  for (const UnitColumn& column : columns) {
    if (column.assumed) {
      names.push_back(fmt::format("'{}'", printable(table.columns()[column.index])));
      units.insert(column.unit.name);
    }
  }
  if (names.size() == columns.size()) {
    names = {"poses"};
  }
  return names.empty() ? ""
                       : fmt::format("{} taken to be in {}", fmt::join(names, ", "),
                                     fmt::join(units, " and "));
}

std::optional<UnitColumn> find_column(const CsvTable& table, std::string_view names,
                                      std::span<const Unit> units, const TableOptions& options) {
  for (const std::string_view name : split_text(names, ' ')) {
    const auto is_it = [&](std::string_view text) {
      return name == "t" ? text == name : alike(text, name);  // T is a temperature
    };
    if (const auto found = table.find(name); found && is_it(table.columns()[*found])) {
      return unit_column(table, *found, units, options);
    }
    for (std::size_t i = 0; i < table.columns().size(); ++i) {
      const auto [stem, unit] = parts_of(table.columns()[i], units);
      if (unit && is_it(stem)) {
        return unit_column(table, i, units, options);
      }
    }
  }
  return {};
}

std::optional<UnitColumn> find_time(const CsvTable& table, const TableOptions& options) {
  const auto named =
      options.time_column.empty() ? std::nullopt : table.find_or_count(options.time_column);
  return named ? unit_column(table, *named, time_units, options)
               : find_column(table, names_of_time, time_units, options);
}

PoseColumns pose_columns(const CsvTable& table, PoseForm form,
                         const std::vector<std::size_t>& indices, const TableOptions& options) {
  const std::vector<Quantity> quantities = quantities_of(form);
  PoseColumns pose{form, {}};
  for (std::size_t i = 0; i < indices.size(); ++i) {
    pose.columns.push_back(unit_column(table, indices[i], quantities[i].units, options));
  }
  return pose;
}

PoseColumns find_pose(const CsvTable& table, const TableOptions& options) {
  PoseColumns pose =
      options.pose_columns.empty() ? usual_pose(table, options) : named_pose(table, options);
  if (is_of_angles(pose.form) && !options.euler.empty()) {
    pose.form = options.euler == "vector" ? PoseForm::rotation_vector : PoseForm::euler;
  }
  if (pose.form == PoseForm::quaternion) {
    order_by_endings(table, {"x", "y", "z", "w"}, pose);  // some write w first
  } else if (pose.form == PoseForm::euler) {
    // Roll is about x, pitch about y and yaw about z; others turn in the order of their columns.
    constexpr std::string_view names[] = {"roll", "pitch", "yaw"};
    std::vector<std::string_view> endings;
    for (const char axis : options.euler.empty() ? std::string("xyz") : options.euler) {
      endings.push_back(names[std::tolower(static_cast<unsigned char>(axis)) - 'x']);
    }
    if (!order_by_endings(table, endings, pose) && options.pose_columns.empty()) {
      std::ranges::sort(std::span(pose.columns).last(3), {}, &UnitColumn::index);
    }
  }
  return pose;
}

}  // namespace palpate
