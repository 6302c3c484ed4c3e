#include "io/table_columns.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

constexpr std::string_view number_mark = "{n}";

/// What a pattern finds of a name.
struct Match {
  bool is_whole = false;
  std::optional<std::int64_t> number;  ///< at `{n}`
};

Match match(std::string_view name, std::string_view pattern) {
  if (pattern.empty()) {
    return {.is_whole = name.empty()};
  }
  if (pattern.starts_with(number_mark)) {
    pattern.remove_prefix(number_mark.size());
    const std::size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
    const auto number = whole_number_of(name.substr(0, digits));
    return {.is_whole = number && match(name.substr(digits), pattern).is_whole, .number = number};
  }
  if (pattern.front() == '*') {
    for (std::size_t skip = 0; skip <= name.size(); ++skip) {
      if (const Match rest = match(name.substr(skip), pattern.substr(1)); rest.is_whole) {
        return rest;
      }
    }
    return {};
  }
  return !name.empty() && alike(name.substr(0, 1), pattern.substr(0, 1))
             ? match(name.substr(1), pattern.substr(1))
             : Match{};
}

/// Chooses the columns of a text, part by part.
class Choice {
 public:
  Choice(const CsvTable& table, const std::vector<std::size_t>& taken, const char* option)
      : table_(table), taken_(taken), option_(option) {}

  /// Adds the columns that the part names; false where it names none.
  bool add(std::string_view part) {
    if (part.find('*') != part.npos || part.find(number_mark) != part.npos) {
      return add_matches(part);
    }
    const auto column = table_.find_or_count(part);
    return column ? add_one(*column) : add_every(part) || add_range(part) || add_prefixed(part);
  }

  std::vector<std::size_t> columns;

 private:
  std::string name(std::size_t column) const {
    return std::string(printable(table_.columns()[column]));
  }
  bool is_taken(std::size_t column) const {
    return std::ranges::find(taken_, column) != taken_.end();
  }

  bool add_one(std::size_t column) {
    if (std::ranges::find(columns, column) != columns.end()) {
      table_.refuse_columns("`{}` names column '{}' twice; leave one out", option_, name(column));
    }
    columns.push_back(column);
    return true;
  }

  /// Whatever of FIRST:LAST names columns, as a name may hold a colon.
  bool add_range(std::string_view part) {
    for (std::size_t colon = part.find(':'); colon != part.npos;
         colon = part.find(':', colon + 1)) {
      const auto first = table_.find_or_count(part.substr(0, colon));
      const auto last = table_.find_or_count(part.substr(colon + 1));
      if (!first || !last) {
        continue;
      }
      if (*last < *first) {
        table_.refuse_columns("column '{}' comes before '{}'; give `{} FIRST:LAST`", name(*last),
                              name(*first), option_);
      }
      for (std::size_t i = *first; i <= *last; ++i) {
        if (is_taken(i)) {
          table_.refuse_columns(
              "column '{}', between '{}' and '{}', holds something else; correct `{} FIRST:LAST`",
              name(i), name(*first), name(*last), option_);
        }
        add_one(i);
      }
      return true;
    }
    return false;
  }

  bool add_every(std::string_view part) {
    const std::size_t colons = part.rfind("::");
    const auto step = colons == part.npos ? std::nullopt : whole_number_of(part.substr(colons + 2));
    const auto first = step ? table_.find_or_count(part.substr(0, colons)) : std::nullopt;
    return first && *step >= 1 && add_those([&](std::size_t i) {
             const bool is_one = i >= *first && (i - *first) % static_cast<std::size_t>(*step) == 0;
             return is_one ? std::optional<std::int64_t>(0) : std::nullopt;
           });
  }

  bool add_matches(std::string_view pattern) {
    return add_those([&](std::size_t i) {
      const Match matched = match(table_.columns()[i], pattern);
      return matched.is_whole ? std::optional(matched.number.value_or(0)) : std::nullopt;
    });
  }

  bool add_prefixed(std::string_view prefix) {
    return add_those([&](std::size_t i) {
      const std::string_view begin = std::string_view(table_.columns()[i]).substr(0, prefix.size());
      return alike(begin, prefix) ? std::optional<std::int64_t>(0) : std::nullopt;
    });
  }

  /// Adds the columns that hold nothing else and to which `number` gives a number, in the order of
  /// the numbers; false where there are none.
  bool add_those(const std::function<std::optional<std::int64_t>(std::size_t)>& number) {
    std::vector<std::pair<std::int64_t, std::size_t>> found;
    for (std::size_t i = 0; i < table_.columns().size(); ++i) {
      if (const auto of_column = is_taken(i) ? std::nullopt : number(i)) {
        found.emplace_back(*of_column, i);
      }
    }
    std::ranges::sort(found);
    for (const auto& [order, column] : found) {
      add_one(column);
    }
    return !found.empty();
  }

  const CsvTable& table_;
  const std::vector<std::size_t>& taken_;
  const char* option_;
};

// Columns in the order in which they were named: p1 and p10 side by side, or p10_z before p2_z,
// come from names that were sorted as texts.
void require_counting_names(const CsvTable& table, const PressureColumns& readings) {
  constexpr std::string_view digits = "0123456789";
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const std::string_view before = table.columns()[readings[i - 1].back()];
    const std::string_view name = table.columns()[readings[i].back()];
    const auto differ = std::ranges::mismatch(before, name).in1 - before.begin();
    const std::size_t begin =
        before.substr(0, static_cast<std::size_t>(differ)).find_last_not_of(digits) + 1;
    const auto number_at = [&](std::string_view text) {  // and what follows it
      const std::size_t end = std::min(text.find_first_not_of(digits, begin), text.size());
      return std::pair{whole_number_of(text.substr(begin, end - begin)), text.substr(end)};
    };
    const auto [first, rest_of_first] = number_at(before);
    const auto [second, rest] = number_at(name);
    if (first && second && *second <= *first && (rest == rest_of_first || before < name)) {
      table.refuse_columns(
          "column '{}' comes after '{}'; order the columns as the array's elements, or name them "
          "one by one by `pressure-columns`",
          printable(name), printable(before));
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

/// x, y and an angle, or a position and a quaternion, perhaps behind a time.
TimedPoseColumns columns_without_names(const CsvTable& table, const TableOptions& options) {
  const std::size_t count = table.columns().size();
  const bool has_time = count == 4 || count == 8;
  std::vector<std::size_t> indices(has_time ? count - 1 : count);
  std::iota(indices.begin(), indices.end(), has_time ? 1 : 0);
  if (indices.size() != 3 && indices.size() != 7) {
    table.refuse(
        "{} columns without names; write x, y, theta or tx, ty, tz, qx, qy, qz, qw, with or "
        "without a time before them, or add a header",
        count);
  }
  const PoseForm form = indices.size() == 3 ? PoseForm::planar : PoseForm::quaternion;
  return {has_time ? std::optional(unit_column(table, 0, time_units, options)) : std::nullopt,
          pose_columns(table, form, indices, options)};
}

/// True where the first column stands alone before the pose and counts or labels nothing.
bool may_be_time(const CsvTable& table, const PoseColumns& pose, const TableOptions& options) {
  constexpr std::string_view others = "frame touch row index seq n id label object";
  const std::string& name = table.columns()[0];
  const auto is_name = [&](std::string_view other) { return alike(other, name); };
  return std::ranges::min(pose.columns, {}, &UnitColumn::index).index == 1 && !name.empty() &&
         std::ranges::none_of(split_text(others, ' '), is_name) &&
         std::ranges::none_of(conditions(options), is_name,
                              &std::pair<std::string, std::string>::first);
}

}  // namespace

std::vector<std::size_t> choose_columns(const CsvTable& table, const std::string& text,
                                        const std::vector<std::size_t>& taken, const char* option) {
  Choice whole(table, taken, option);
  if (whole.add(text)) {
    return std::move(whole.columns);  // a name may hold a comma
  }
  Choice choice(table, taken, option);
  for (const std::string_view part : split_text(text, ',')) {
    if (part.empty() || !choice.add(trimmed(part))) {
      table.refuse_columns(
          "no column is called or begins with '{}'; give `{}` names or numbers of columns, "
          "FIRST:LAST, START::STEP or a pattern such as *_fz or p{{n}}",
          printable(part), option);
    }
  }
  return std::move(choice.columns);
}

PressureColumns pressure_columns(const CsvTable& table, const std::vector<std::size_t>& columns,
                                 std::size_t elements, const TableOptions& options) {
  const bool has_axes = columns.size() == 3 * elements;
  PressureColumns readings;
  if (has_axes && !options.pressure_component.empty()) {
    readings = axes_of(table, columns);
  } else if (columns.size() != elements || !options.pressure_component.empty()) {
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
  } else {
    std::ranges::transform(columns, std::back_inserter(readings),
                           [](std::size_t column) { return std::vector{column}; });
  }
  // Columns that are named one by one are in the order that is meant.
  if (split_text(options.pressure_columns, ',').size() != columns.size()) {
    require_counting_names(table, readings);
  }
  return readings;
}

bool is_of_blocks(const CsvTable& table, const TableOptions& options) {
  return options.grid && (*options.grid)[1] > 1 && table.columns().size() == (*options.grid)[0];
}

double reading_in(const CsvTable& table, const std::vector<std::size_t>& axes, bool is_norm) {
  if (!is_norm) {
    return table.number(axes.back()).value_or(std::numeric_limits<double>::quiet_NaN());
  }
  double sum = 0.0;
  for (const std::size_t axis : axes) {
    const double part = table.number(axis).value_or(std::numeric_limits<double>::quiet_NaN());
    sum += part * part;
  }
  return std::sqrt(sum);
}

TimedPoseColumns find_columns(const CsvTable& table, const TableOptions& options) {
  PoseColumns pose = find_pose(table, options);
  if (pose.columns.empty() && !table.has_header()) {
    return columns_without_names(table, options);
  }
  if (pose.columns.empty()) {
    table.refuse_columns("has no columns 'x', 'y' and 'theta'; rename its columns{}",
                         options.may_name_poses
                             ? ", or name them by `pose-columns`: X,Y,THETA, or in space "
                               "X,Y,Z,ROLL,PITCH,YAW or TX,TY,TZ,QX,QY,QZ,QW"
                             : "");
  }
  std::optional<UnitColumn> time = find_time(table, options);
  if (!time && options.needs_times && may_be_time(table, pose, options)) {
    time = unit_column(table, 0, time_units, options);
  }
  return {time, std::move(pose)};
}

}  // namespace palpate
