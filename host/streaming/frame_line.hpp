#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "palpate/pose.hpp"
#include "palpate/sensor.hpp"

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

/// Reads lines with frames, and perhaps the pose at which each was read.
///
/// JSON: an object with `pressure`, a list of the array's readings or a list of such lists, and
/// where they are known `time` (s) and x_mm, y_mm and theta_rad of T_robot_sensor; or the list
/// alone. null, and the NaN that Python writes, is an Unknown reading.
///
/// CSV, its cells separated by tabs, semicolons, commas or blanks: with a header, columns of the
/// names above and one for each reading (`device_time` and `lost_before` are left out); without
/// one, the readings alone, behind a time, or behind time, x_mm, y_mm and theta_rad. The first line
/// decides, also whether a separator follows the last cell. An empty cell or nan is an Unknown
/// reading.
class FrameLines {
 public:
  using Problem = PoseLines::Problem;
  using Header = PoseLines::Header;

  /// @param elements of the array, e
  explicit FrameLines(std::size_t elements) : elements_(elements) {}

  std::size_t elements() const { return elements_; }

  /// @param line not blank
  /// @param now_s the time of frames without a time of their own
  std::variant<Frame, Problem, Header> read(std::string_view line, double now_s);

  /// True for a line of words, such as a board prints as it starts: no JSON, and at most half of it
  /// numbers.
  static bool is_text(std::string_view line);

 private:
  std::variant<Frame, Problem, Header> read_json(std::string_view line, double now_s) const;
  std::variant<Frame, Problem, Header> read_csv(std::string_view line, double now_s);
  std::variant<Frame, Problem, Header> read_header(const std::vector<std::string_view>& cells);
  std::variant<Frame, Problem, Header> frame_of(PoseLines::Numbers numbers,
                                                std::vector<double> values, double now_s) const;

  std::size_t elements_;
  /// What each column of CSV holds: an index of PoseLines::names, a reading, or what is left out.
  std::vector<std::size_t> columns_;
};

}  // namespace palpate
