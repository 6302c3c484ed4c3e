#include "streaming/stream_lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "io/csv_cells.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "model/refuse.hpp"
#include "palpate/pose_track.hpp"

namespace palpate {

namespace {

using Kind = FrameLines::Flaw::Kind;

constexpr double unknown_reading_number = std::numeric_limits<double>::quiet_NaN();

bool is_json(std::string_view text) { return text.starts_with('{') || text.starts_with('['); }

/// Adds the numbers of a list, or of lists in it; false where it holds anything else.
bool add_readings(const nlohmann::json& list, std::vector<double>& values, bool nested = false) {
  return std::ranges::all_of(list, [&](const nlohmann::json& item) {
    if (item.is_array() && !nested) {
      return add_readings(item, values, true);
    }
    if (item.is_number() || item.is_null()) {
      values.push_back(item.is_null() ? unknown_reading_number : item.get<double>());
    }
    return item.is_number() || item.is_null();
  });
}

/// The line with null in the place of the numbers that Python writes and JSON does not know.
std::string without_nan(std::string_view line) {
  std::string text(line);
  for (const std::string_view none : {"NaN", "-Infinity", "Infinity"}) {
    for (std::size_t at = text.find(none); at != text.npos; at = text.find(none, at)) {
      text.replace(at, none.size(), "null");
    }
  }
  return text;
}

/// The reading in a cell, NaN where it is Unknown; none where the cell holds no number.
std::optional<double> reading_in(std::string_view cell) {
  return cell.empty() ? unknown_reading_number : detail::all_of<double>(cell);
}

}  // namespace

LineReader::LineReader(std::string kind, const std::string& name, std::size_t longest,
                       std::function<void(const Line&)> take)
    : kind_(std::move(kind)),
      name_(name == "-" ? "standard input" : name),
      longest_(longest),
      take_(std::move(take)) {
  if (name != "-") {
    file_ = Descriptor(name, O_RDONLY | O_NONBLOCK);  // not waiting for the writer of a FIFO
  }
  descriptor_ = name == "-" ? STDIN_FILENO : file_.get();
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    refuse(kind_ + " " + name, "cannot be read: {}; give a file, a FIFO or - for standard input",
           std::strerror(errno));
  }
  if (S_ISDIR(status.st_mode)) {
    refuse(kind_ + " " + name, "is a folder; name a file in it");
  }
  is_file_ = S_ISREG(status.st_mode);
  is_fifo_ = S_ISFIFO(status.st_mode) && descriptor_ != STDIN_FILENO;
}

bool LineReader::read_some(std::chrono::milliseconds wait) {
  char bytes[1 << 14];
  pollfd ready{.fd = descriptor_, .events = POLLIN, .revents = 0};
  if (ended_ || (!is_file_ && ::poll(&ready, 1, static_cast<int>(wait.count())) <= 0)) {
    return false;
  }
  const ssize_t got = ::read(descriptor_, bytes, sizeof bytes);
  if (got > 0) {
    take({bytes, static_cast<std::size_t>(got)});
    return true;
  }
  if (got < 0 && is_file_) {
    refuse(kind_ + " " + name_, "cannot be read: {}; copy or record it again",
           std::strerror(errno));
  }
  if (got == 0 && !is_fifo_) {
    ended_ = true;
    if (!line_.empty() || too_long_) {
      end_line();
    }
  }
  return false;
}

void LineReader::take(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, end);
    if (line_.size() + part.size() > longest_) {
      too_long_ = true;
    } else {
      line_ += part;
    }
    if (end == std::string_view::npos) {
      return;
    }
    end_line();
    bytes.remove_prefix(end + 1);
  }
}

void LineReader::end_line() {
  ++lines_;
  const std::string text = std::exchange(line_, {});
  if (std::exchange(too_long_, false)) {
    take_({.number = lines_, .text = {}, .too_long = true});
  } else if (text.find_first_not_of(" \t\r") != std::string::npos) {
    take_({.number = lines_, .text = text});
  }
}

FrameLines::Line FrameLines::read(std::string_view line, double now_s) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  if (line.starts_with(byte_order_mark)) {
    line.remove_prefix(byte_order_mark.size());
  }
  const std::string_view text = trimmed(line);
  const bool is_first = std::exchange(is_first_, false);
  return is_json(text) ? read_json(text, now_s) : read_csv(line, is_first, now_s);
}

FrameLines::Line FrameLines::read_json(std::string_view line, double now_s) const {
  nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
  if (json.is_discarded()) {
    json = nlohmann::json::parse(without_nan(line), nullptr, false);
  }
  if (of_poses() && !json.is_object()) {
    return Flaw{Kind::malformed, "is no JSON object"};
  }
  if (json.is_discarded()) {
    return Flaw{Kind::malformed, "is no whole JSON"};
  }
  const nlohmann::json* list = json.is_array() ? &json : nullptr;
  Numbers numbers;
  if (json.is_object()) {
    const auto found = json.find("pressure");
    list = found != json.end() && found->is_array() ? &*found : nullptr;
    for (std::size_t k = 0; k < names.size(); ++k) {
      const auto number = json.find(names[k]);
      if (number != json.end() && number->is_number()) {
        numbers[k] = number->get<double>();
      } else if (number != json.end() && !number->is_null() && !of_poses()) {
        return Flaw{Kind::no_number, fmt::format("'{}' is no number", names[k])};
      }
    }
  }
  std::vector<double> values;
  if (!of_poses() && list == nullptr) {
    return Flaw{Kind::malformed, "has no list 'pressure'"};
  }
  if (!of_poses() && !add_readings(*list, values)) {
    return Flaw{Kind::no_number, "'pressure' holds something else than numbers and null"};
  }
  return frame_of(numbers, std::move(values), now_s);
}

FrameLines::Line FrameLines::read_header(const std::vector<std::string_view>& cells) {
  std::vector<std::size_t> columns;
  for (const std::string_view name : cells) {
    const auto found = std::ranges::find(names, name);
    const bool is_other = of_poses() && found == names.end();
    columns.push_back(name.empty() || name == "device_time" || name == "lost_before" || is_other
                          ? left_out
                          : static_cast<std::size_t>(found - names.begin()));
  }
  const auto readings = static_cast<std::size_t>(std::ranges::count(columns, reading));
  if (readings != elements_) {
    return Flaw{Kind::malformed,
                fmt::format("names {} readings for an array of {} elements", readings, elements_)};
  }
  for (std::size_t k = 0; k < names.size() && of_poses(); ++k) {
    if (std::ranges::find(columns, k) == columns.end()) {
      return Flaw{Kind::malformed, fmt::format("names no column '{}'", names[k])};
    }
  }
  columns_ = std::move(columns);
  return Header{};
}

/// Finds what the columns of rows without a header hold, by the first row.
std::optional<FrameLines::Flaw> FrameLines::find_columns(
    const std::vector<std::string_view>& cells) {
  // An empty last cell is behind a separator that ends the row, or, with a time since 1970,
  // Unknown.
  const std::size_t more = cells.size() - std::min(cells.size(), elements_);
  const bool is_reading =
      (more == 1 || more == reading) && reading_in(cells.front()).value_or(0.0) > 1e8;
  const std::size_t filled = cells.size() - (cells.back().empty() && !is_reading ? 1 : 0);
  const std::size_t before = of_poses() ? reading : filled - std::min(filled, elements_);
  if (filled < elements_ || (before > 1 && before != reading)) {
    return Flaw{Kind::malformed,
                fmt::format("has {} numbers for an array of {} elements", filled, elements_)};
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    columns_.push_back(i < before ? i : i < filled && !of_poses() ? reading : left_out);
  }
  return {};
}

FrameLines::Line FrameLines::read_csv(std::string_view line, bool is_first, double now_s) {
  std::vector<std::string_view> cells;
  const bool has_columns = !columns_.empty();
  if (!has_columns) {
    // A pose may have other cells behind it, with other separators in them.
    const bool has_commas =
        of_poses() && split_cells(line, ',', cells) == nullptr && cells.size() >= names.size();
    separator_ = has_commas ? ',' : separator_of(line);
  }
  if (const char* fault = split_cells(line, separator_, cells)) {
    return Flaw{Kind::malformed, fault};
  }
  if (of_poses() && cells.size() < names.size()) {
    return Flaw{Kind::malformed, "is no JSON object, and no row of CSV with four numbers"};
  }
  if (!has_columns) {
    if ((is_first || !of_poses()) && !reading_in(cells.front())) {
      return read_header(cells);
    }
    if (auto flaw = find_columns(cells)) {
      return *std::move(flaw);
    }
  }
  Line row = read_row(cells, now_s);
  if (!has_columns && !std::holds_alternative<Frame>(row)) {
    columns_.clear();  // a refused line says nothing of the others
  }
  return row;
}

FrameLines::Line FrameLines::read_row(const std::vector<std::string_view>& cells,
                                      double now_s) const {
  if (!of_poses() && cells.size() != columns_.size()) {
    return Flaw{Kind::malformed,
                fmt::format("has {} cells, the first line {}", cells.size(), columns_.size())};
  }
  Numbers numbers;
  std::vector<double> values;
  for (std::size_t i = 0; i < std::min(cells.size(), columns_.size()); ++i) {
    const std::size_t column = columns_[i];
    if (column == left_out) {
      continue;
    }
    const std::optional<double> number = reading_in(cells[i]);
    if (of_poses()) {
      numbers[column] = number && std::isfinite(*number) ? number : std::nullopt;
      continue;
    }
    if (!number || (column == 0 && !std::isfinite(*number))) {
      // A message stays one short line whatever the cell holds.
      const bool shown = cells[i].size() <= 60 && is_printable(cells[i]);
      return Flaw{Kind::no_number, fmt::format("column {}{} is no {}", i + 1,
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
  std::vector<std::string_view> cells;
  if (is_json(trimmed(line))) {
    return false;
  }
  if (split_cells(line, separator_of(line), cells) != nullptr) {
    return true;
  }
  const auto words = std::ranges::count_if(
      cells, [](std::string_view cell) { return !reading_in(cell).has_value(); });
  return 2 * static_cast<std::size_t>(words) >= cells.size();
}

bool FrameLines::names_columns(std::string_view line) const {
  std::vector<std::string_view> cells;
  const char separator = separator_of(line);
  return !is_json(trimmed(line)) && separator != ' ' &&
         split_cells(line, separator, cells) == nullptr && cells.size() > 1 &&
         std::ranges::all_of(
             cells, [](std::string_view cell) { return cell.empty() || !reading_in(cell); }) &&
         (cells.size() >= elements_ || std::ranges::any_of(cells, [](std::string_view cell) {
            return std::ranges::find(names, cell) != names.end();
          }));
}

FrameLines::Line FrameLines::frame_of(Numbers numbers, std::vector<double> values,
                                      double now_s) const {
  if (values.size() != elements_) {
    return Flaw{Kind::malformed, fmt::format("has {} readings for an array of {} elements",
                                             values.size(), elements_)};
  }
  auto& [time_s, x_mm, y_mm, theta_rad] = numbers;
  if (!of_poses()) {
    time_s = time_s.value_or(now_s);
  }
  std::optional<Pose> pose;
  if (of_poses() || x_mm || y_mm || theta_rad) {
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (!numbers[k]) {
        return Flaw{Kind::no_number, fmt::format("has no number '{}'", names[k])};
      }
    }
    pose = Pose{{*x_mm, *y_mm}, *theta_rad};
    if (!is_robot_pose(*pose)) {
      return Flaw{
          Kind::far_away,
          fmt::format("x_mm = {}, y_mm = {}, theta_rad = {}: no robot is further away than 1e9 mm, "
                      "or has turned by more than 1e9 rad",
                      *x_mm, *y_mm, *theta_rad)};
    }
  }
  return Frame{.host_time_s = *time_s, .values = std::move(values), .T_robot_sensor = pose};
}

}  // namespace palpate
