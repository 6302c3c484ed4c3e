#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/stream_time.hpp"
#include "palpate/sensor.hpp"
#include "streaming/frame_smoother.hpp"

namespace palpate {

/// What the elements of an array read untouched, over a stream, in the sensor's unit.
struct Rest {
  double window_s = 0.0;            ///< what lasts longer counts as rest
  std::vector<double> time_s;       ///< [b] since the stream's first frame, ascending
  std::vector<float> readings;      ///< [e, b]
  std::optional<double> changes_s;  ///< when an element first changes by the onset and seems to
                                    ///< drift, as in a long or slow press or one that is cut off
  bool falls = false;               ///< the readings fall in presses

  /// Writes the rest at a time, [e]: interpolated, and constant beyond the first and last time.
  void at(double elapsed_s, std::vector<double>& rest) const;
};

/// Finds the rest of a drifting array from its whole stream, which may be touched at any time.
///
/// An element's rest is the morphological opening of its reading over 2 s: the running minimum, and
/// the running maximum of this. Drift and jumps pass an opening unchanged; shorter presses do not.
/// What stands out of this rest when it is opened over 4, 8, 16 and 32 s in turn, and so returns to
/// where it came from, is a longer press where it rises and falls faster than by the onset in 3 s;
/// it is drift, or what stays after a press, where it is slower. Across a press the rest is a line
/// from its value before to its value after. A press that is under way as the stream begins or ends
/// counts as rest. Readings are means of 0.1 s of medians over three frames.
///
/// Memory: three floats for each element and tenth of a second. Time: O(1) for each of these.
class RestFinder {
 public:
  /// @param valid empty or [e]; 0 = dead element, whose rest is 0
  /// @param onset, release as in TouchDetectorOptions
  RestFinder(std::span<const std::uint8_t> valid, double onset, double release);

  /// Takes the stream's next frame; one that is_readable() refuses is ignored.
  void add(const Frame& frame);

  /// Returns the rest of the stream. With `window_s`, what is shorter is a press at any speed.
  Rest find(std::optional<double> window_s);

 private:
  struct Outline;
  struct Found;

  bool is_alive(std::size_t element) const { return valid_.empty() || valid_[element] != 0; }
  void end_block();
  std::vector<float> column(std::size_t element, float sign) const;
  Outline open(float sign, double window_s, std::vector<float>& rest) const;
  Outline humps(double window_s, std::span<const float> rest) const;
  void bridge(const Outline& outline, double edge_s, Found& found) const;
  std::size_t foot_of(const Outline& outline, std::span<const float> rest, std::size_t block,
                      int way) const;
  Found rest_of(float sign, std::optional<double> window_s) const;
  double first_step(std::span<const float> rest) const;

  std::vector<std::uint8_t> valid_;
  double onset_;
  double release_;
  StreamTime time_;
  FrameSmoother smoother_;
  std::size_t elements_ = 0;
  std::vector<double> pressure_;     ///< [e] of the present frame; NaN: Unknown
  std::vector<std::uint8_t> known_;  ///< [e] in the present block
  std::optional<double> begin_s_;    ///< of the present block
  double last_s_ = 0.0;
  std::vector<double> time_s_;   ///< [b]
  std::vector<float> readings_;  ///< [b, e]; NaN: Unknown
};

}  // namespace palpate
