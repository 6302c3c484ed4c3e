#pragma once

#include <cstddef>
#include <string_view>
#include <variant>
#include <vector>

#include "palpate/sensor.hpp"
#include "streaming/pose_line.hpp"

namespace palpate {

/// Reads lines with frames, and perhaps the pose at which each was read.
///
/// JSON: an object with `pressure`, a list of the array's readings or a list of such lists, and
/// where they are known `time` (s) and x_mm, y_mm and theta_rad of T_robot_sensor; or the list
/// alone. null is an Unknown reading.
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
