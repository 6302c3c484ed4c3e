#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "palpate/pose.hpp"

namespace palpate {

/// The text without the blanks around it.
std::string_view trimmed(std::string_view text);

/// Reads lines with poses: JSON objects, or CSV of time, x_mm, y_mm and theta_rad in the order of a
/// header, or in this one where there is no header.
class PoseLines {
 public:
  struct TimedPose {
    double time_s = 0.0;
    Pose T_robot_sensor;
  };
  struct Problem {
    enum class Kind { malformed, no_number, far_away } kind = Kind::malformed;
    std::string words;
  };
  struct Header {};

  static constexpr std::array<const char*, 4> names{"time", "x_mm", "y_mm", "theta_rad"};
  using Numbers = std::array<std::optional<double>, 4>;  ///< in the order of `names`

  /// @param line not blank
  std::variant<TimedPose, Problem, Header> read(std::string_view line);
  static std::variant<TimedPose, Problem, Header> pose_of(const Numbers& numbers);

 private:
  std::variant<TimedPose, Problem, Header> read_csv(std::string_view line, bool first);

  std::array<std::size_t, 4> columns_{0, 1, 2, 3};
  bool first_ = true;
};

}  // namespace palpate
