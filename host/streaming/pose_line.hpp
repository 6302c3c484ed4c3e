#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "palpate/pose.hpp"

namespace palpate {

/// Reads lines with poses: JSON objects, or CSV of time, x_mm, y_mm and theta_rad in the order of a
/// header, or in this one where there is no header.
class PoseLines {
 public:
  struct TimedPose {
    double time_s = 0.0;
    Pose T_robot_sensor;
  };
  struct Problem {
    enum class Kind { no_pose, no_number, far_away } kind = Kind::no_pose;
    std::string words;
  };
  struct Header {};

  /// @param line not blank
  std::variant<TimedPose, Problem, Header> read(std::string_view line);

 private:
  using Numbers = std::array<std::optional<double>, 4>;

  std::variant<TimedPose, Problem, Header> read_csv(std::string_view line, bool first);
  static std::variant<TimedPose, Problem, Header> pose_of(const Numbers& numbers);

  std::array<std::size_t, 4> columns_{0, 1, 2, 3};
  bool first_ = true;
};

}  // namespace palpate
