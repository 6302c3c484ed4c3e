#pragma once

#include <array>
#include <bitset>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "model/descriptor.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Reads the lines of a file, a FIFO or standard input as they come, a block at a time.
class LineReader {
 public:
  struct Line {
    std::uint64_t number = 0;  ///< from 1
    std::string_view text;     ///< not blank; "" where the line is too long
    bool too_long = false;
  };

  /// @param kind what the lines hold, for messages
  /// @param name path of a file or FIFO, or "-": standard input
  /// @param longest bytes of a line; a stream that never ends its line must not fill the memory
  /// @param take called from within read_some() with each line that is not blank
  /// @throws Error (Fault::input) where `name` cannot be read
  LineReader(std::string kind, const std::string& name, std::size_t longest,
             std::function<void(const Line&)> take);

  /// Waits at most so long for bytes and reads one block of them; false where none came.
  /// @throws Error (Fault::input) where a file cannot be read; what `take` throws
  bool read_some(std::chrono::milliseconds wait = {});

  /// The path, or "standard input".
  const std::string& name() const { return name_; }
  bool is_file() const { return is_file_; }
  /// True after the last line; a FIFO has none, as it may get another writer.
  bool ended() const { return ended_; }

 private:
  void take(std::string_view bytes);
  void end_line();

  std::string kind_;
  std::string name_;
  std::size_t longest_;
  std::function<void(const Line&)> take_;
  Descriptor file_;      ///< none for standard input
  int descriptor_ = -1;  ///< its number
  bool is_file_ = false;
  bool is_fifo_ = false;
  bool ended_ = false;
  std::string line_;       ///< the line under way
  bool too_long_ = false;  ///< the line under way is longer than `longest_`
  std::uint64_t lines_ = 0;
};

/// Reads lines with frames, and perhaps the pose at which each was read; or lines with poses, which
/// are frames without readings.
///
/// JSON: an object with `pressure`, a list of the array's readings or a list of such lists, and
/// where they are known `time` (s) and x_mm, y_mm and theta_rad of T_robot_sensor; or the list
/// alone. null, and the NaN that Python writes, is an Unknown reading.
///
/// CSV, its cells separated by tabs, semicolons, commas or blanks: with a header, columns of the
/// names above and one for each reading (`device_time` and `lost_before` are left out); without
/// one, the readings alone, behind a time, or behind time, x_mm, y_mm and theta_rad. The first line
/// decides, also what the separator is and whether one follows the last cell. An empty cell or nan
/// is an Unknown reading.
///
/// A pose has all four numbers. In lines of poses, other columns and keys are left out, and commas
/// separate the cells where a line has three or more.
class FrameLines {
 public:
  /// What is wrong with a line. PoseTrack finds the last two, which frames do not have; a clock
  /// that was set back refuses no line.
  struct Flaw {
    enum class Kind {
      malformed,
      too_long,
      no_number,
      far_away,
      out_of_order,
      clock_set_back,
      kinds
    };
    Kind kind = Kind::malformed;
    std::string words;
  };
  struct Header {};
  using Line = std::variant<Frame, Flaw, Header>;

  /// @param elements of the array, e; 0: the lines are poses
  explicit FrameLines(std::size_t elements) : elements_(elements) {}

  std::size_t elements() const { return elements_; }

  /// @param line not blank
  /// @param now_s the time of frames without a time of their own; not used for poses
  Line read(std::string_view line, double now_s);

  /// True for a line of words, such as a board prints as it starts: no JSON, and at most half of it
  /// numbers.
  static bool is_text(std::string_view line);
  /// True for words between commas, semicolons or tabs that are the header of other columns than
  /// these lines may have: as many as there are elements, or with a name of a time or pose.
  bool names_columns(std::string_view line) const;

 private:
  static constexpr std::array<const char*, 4> names{"time", "x_mm", "y_mm", "theta_rad"};
  // What a column of CSV holds: an index of `names`, or one of these.
  static constexpr std::size_t reading = names.size();
  static constexpr std::size_t left_out = reading + 1;
  using Numbers = std::array<std::optional<double>, names.size()>;  ///< in the order of `names`

  bool of_poses() const { return elements_ == 0; }
  Line read_json(std::string_view line, double now_s) const;
  Line read_csv(std::string_view line, bool is_first, double now_s);
  Line read_header(const std::vector<std::string_view>& cells);
  std::optional<Flaw> find_columns(const std::vector<std::string_view>& cells);
  Line read_row(const std::vector<std::string_view>& cells, double now_s) const;
  Line frame_of(Numbers numbers, std::vector<double> values, double now_s) const;

  std::size_t elements_;
  bool is_first_ = true;              ///< no line was read: only the first may be a header of poses
  std::vector<std::size_t> columns_;  ///< of CSV; empty before its first row or header
  char separator_ = ',';              ///< between them
};

/// The lines of a stream that are refused: the first one is kept, the first of each kind said.
class RefusedLines {
 public:
  /// @param warn may be empty
  explicit RefusedLines(std::function<void(const std::string&)> warn) : warn_(std::move(warn)) {}

  void add(FrameLines::Flaw::Kind kind, const std::string& text) {
    first_ = first_.empty() ? text : first_;
    say(kind, text);
  }
  /// Says the first of a kind, without refusing it.
  void say(FrameLines::Flaw::Kind kind, const std::string& text) {
    const auto index = static_cast<std::size_t>(kind);
    if (warn_ && !told_[index]) {
      warn_(text);
    }
    told_.set(index);
  }
  const std::string& first() const { return first_; }

 private:
  std::function<void(const std::string&)> warn_;
  std::string first_;
  std::bitset<static_cast<std::size_t>(FrameLines::Flaw::Kind::kinds)> told_;
};

}  // namespace palpate
