#include "streaming/frame_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "io/csv_cells.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "palpate/pose_track.hpp"

namespace palpate {

namespace {

std::optional<double> finite(std::optional<double> number) {
  return number && std::isfinite(*number) ? number : std::nullopt;
}

}  // namespace

std::variant<PoseLines::TimedPose, PoseLines::Problem, PoseLines::Header> PoseLines::read(
    std::string_view line) {
  const bool first = std::exchange(first_, false);
  if (trimmed(line).front() != '{') {
    return read_csv(line, first);
  }
  const nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object()) {
    return Problem{Problem::Kind::malformed, "is no JSON object"};
  }
  Numbers numbers;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto found = json.find(names[k]);
    if (found != json.end() && found->is_number()) {
      numbers[k] = finite(found->get<double>());
    }
  }
  return pose_of(numbers);
}

std::variant<PoseLines::TimedPose, PoseLines::Problem, PoseLines::Header> PoseLines::read_csv(
    std::string_view line, bool first) {
  std::vector<std::string_view> fields = split_text(line, ',');
  std::ranges::transform(fields, fields.begin(), trimmed);
  if (fields.size() < names.size()) {
    return Problem{Problem::Kind::malformed,
                   "is no JSON object, and no row of CSV with four numbers"};
  }
  if (first && !number_of(fields.front())) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto found = std::ranges::find(fields, names[k]);
      if (found == fields.end()) {
        return Problem{Problem::Kind::malformed, fmt::format("names no column '{}'", names[k])};
      }
      columns_[k] = static_cast<std::size_t>(found - fields.begin());
    }
    return Header{};
  }
  Numbers numbers;
  for (std::size_t k = 0; k < names.size(); ++k) {
    numbers[k] =
        columns_[k] < fields.size() ? finite(number_of(fields[columns_[k]])) : std::nullopt;
  }
  return pose_of(numbers);
}

std::variant<PoseLines::TimedPose, PoseLines::Problem, PoseLines::Header> PoseLines::pose_of(
    const Numbers& numbers) {
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!numbers[k]) {
      return Problem{Problem::Kind::no_number, fmt::format("has no number '{}'", names[k])};
    }
  }
  const TimedPose pose{*numbers[0], {{*numbers[1], *numbers[2]}, *numbers[3]}};
  if (!is_robot_pose(pose.T_robot_sensor)) {
    return Problem{
        Problem::Kind::far_away,
        fmt::format("x_mm = {}, y_mm = {}, theta_rad = {}: no robot is further away than "
                    "1e9 mm, or has turned by more than 1e9 rad",
                    *numbers[1], *numbers[2], *numbers[3])};
  }
  return pose;
}

namespace {

using Kind = PoseLines::Problem::Kind;

constexpr std::size_t reading = PoseLines::names.size();
constexpr std::size_t left_out = reading + 1;
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Adds the numbers of a list, or of lists in it; false where it holds anything else.
bool add_readings(const nlohmann::json& list, std::vector<double>& values, bool nested = false) {
  return std::ranges::all_of(list, [&](const nlohmann::json& item) {
    if (item.is_array() && !nested) {
      return add_readings(item, values, true);
    }
    if (item.is_number() || item.is_null()) {
      values.push_back(item.is_null() ? unknown : item.get<double>());
    }
    return item.is_number() || item.is_null();
  });
}

/// The line with null in the place of the NaN that Python writes, which JSON does not know.
std::string without_nan(std::string_view line) {
  constexpr std::string_view nan = "NaN";
  std::string text;
  bool quoted = false;
  for (std::size_t at = 0; at < line.size(); ++at) {
    quoted = quoted != (line[at] == '"' && (at == 0 || line[at - 1] != '\\'));
    if (!quoted && line.substr(at, nan.size()) == nan) {
      text += "null";
      at += nan.size() - 1;
    } else {
      text += line[at];
    }
  }
  return text;
}

/// The reading in a cell, NaN where it is Unknown; none where the cell holds no number.
std::optional<double> reading_in(std::string_view cell) {
  return cell.empty() ? unknown : detail::all_of<double>(cell);
}

}  // namespace

std::variant<Frame, FrameLines::Problem, FrameLines::Header> FrameLines::read(std::string_view line,
                                                                              double now_s) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  if (line.starts_with(byte_order_mark)) {
    line.remove_prefix(byte_order_mark.size());
  }
  const std::string_view text = trimmed(line);
  return text.starts_with('{') || text.starts_with('[') ? read_json(text, now_s)
                                                        : read_csv(line, now_s);
}

std::variant<Frame, FrameLines::Problem, FrameLines::Header> FrameLines::read_json(
    std::string_view line, double now_s) const {
  nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
  if (json.is_discarded()) {
    json = nlohmann::json::parse(without_nan(line), nullptr, false);
  }
  if (json.is_discarded()) {
    return Problem{Kind::malformed, "is no whole JSON"};
  }
  const nlohmann::json* list = &json;
  PoseLines::Numbers numbers;
  if (json.is_object()) {
    const auto found = json.find("pressure");
    if (found == json.end() || !found->is_array()) {
      return Problem{Kind::malformed, "has no list 'pressure'"};
    }
    list = &*found;
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const auto number = json.find(PoseLines::names[k]);
      if (number == json.end() || number->is_null()) {
        continue;
      }
      if (!number->is_number()) {
        return Problem{Kind::no_number, fmt::format("'{}' is no number", PoseLines::names[k])};
      }
      numbers[k] = number->get<double>();
    }
  }
  std::vector<double> values;
  if (!add_readings(*list, values)) {
    return Problem{Kind::no_number, "'pressure' holds something else than numbers and null"};
  }
  return frame_of(numbers, std::move(values), now_s);
}

std::variant<Frame, FrameLines::Problem, FrameLines::Header> FrameLines::read_header(
    const std::vector<std::string_view>& cells) {
  std::vector<std::size_t> columns;
  for (const std::string_view name : cells) {
    const auto found = std::ranges::find(PoseLines::names, name);
    columns.push_back(name.empty() || name == "device_time" || name == "lost_before"
                          ? left_out
                          : static_cast<std::size_t>(found - PoseLines::names.begin()));
  }
  const auto readings = static_cast<std::size_t>(std::ranges::count(columns, reading));
  if (readings != elements_) {
    return Problem{Kind::malformed, fmt::format("names {} readings for an array of {} elements",
                                                readings, elements_)};
  }
  columns_ = std::move(columns);
  return Header{};
}

std::variant<Frame, FrameLines::Problem, FrameLines::Header> FrameLines::read_csv(
    std::string_view line, double now_s) {
  std::vector<std::string_view> cells;
  if (const char* problem = split_cells(line, separator_of(line), cells)) {
    return Problem{Kind::malformed, problem};
  }
  if (columns_.empty()) {
    if (!reading_in(cells.front())) {
      return read_header(cells);
    }
    const std::size_t filled = cells.size() - (cells.back().empty() ? 1 : 0);
    const std::size_t before = filled - std::min(filled, elements_);
    if (filled < elements_ || (before > 1 && before != reading)) {
      return Problem{Kind::malformed,
                     fmt::format("has {} numbers for an array of {} elements", filled, elements_)};
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      columns_.push_back(i < before ? i : i < filled ? reading : left_out);
    }
  }
  if (cells.size() != columns_.size()) {
    return Problem{Kind::malformed,
                   fmt::format("has {} cells, the first line {}", cells.size(), columns_.size())};
  }
  PoseLines::Numbers numbers;
  std::vector<double> values;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::size_t column = columns_[i];
    if (column == left_out) {
      continue;
    }
    const std::optional<double> number = reading_in(cells[i]);
    if (!number || (column == 0 && !std::isfinite(*number))) {
      // A message stays one short line whatever the cell holds.
      const bool shown = cells[i].size() <= 60 && is_printable(cells[i]);
      return Problem{Kind::no_number, fmt::format("column {}{} is no {}", i + 1,
                                                  shown ? fmt::format(" = '{}'", cells[i]) : "",
                                                  column == 0 ? "time" : "number")};
    }
    if (column == reading) {
      values.push_back(*number);
    } else if (!std::isnan(*number)) {
      numbers[column] = *number;
    }
  }
  return frame_of(numbers, std::move(values), now_s);
}

bool FrameLines::is_text(std::string_view line) {
  const std::string_view text = trimmed(line);
  std::vector<std::string_view> cells;
  if (text.starts_with('{') || text.starts_with('[') ||
      split_cells(line, separator_of(line), cells) != nullptr) {
    return !text.starts_with('{') && !text.starts_with('[');
  }
  const auto words = std::ranges::count_if(
      cells, [](std::string_view cell) { return !reading_in(cell).has_value(); });
  return 2 * static_cast<std::size_t>(words) >= cells.size();
}

std::variant<Frame, FrameLines::Problem, FrameLines::Header> FrameLines::frame_of(
    PoseLines::Numbers numbers, std::vector<double> values, double now_s) const {
  if (values.size() != elements_) {
    return Problem{Kind::malformed, fmt::format("has {} readings for an array of {} elements",
                                                values.size(), elements_)};
  }
  const auto [time_s, x_mm, y_mm, theta_rad] = numbers;
  Frame frame{.host_time_s = time_s.value_or(now_s), .values = std::move(values)};
  if (x_mm || y_mm || theta_rad) {
    numbers[0] = frame.host_time_s;
    const auto pose = PoseLines::pose_of(numbers);
    if (const auto* problem = std::get_if<Problem>(&pose)) {
      return *problem;
    }
    frame.T_robot_sensor = std::get<PoseLines::TimedPose>(pose).T_robot_sensor;
  }
  return frame;
}

}  // namespace palpate
