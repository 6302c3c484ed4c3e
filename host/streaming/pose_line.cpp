#include "streaming/pose_line.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "model/number_text.hpp"
#include "palpate/pose_track.hpp"

namespace palpate {

namespace {

std::optional<double> finite(std::optional<double> number) {
  return number && std::isfinite(*number) ? number : std::nullopt;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  constexpr const char* blanks = " \t\r";
  const std::size_t begin = std::min(text.find_first_not_of(blanks), text.size());
  return text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

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

}  // namespace palpate
