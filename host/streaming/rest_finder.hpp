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
  double window_s = 0.0;          ///< what lasts longer counts as rest
  std::vector<double> time_s;     ///< [b] since the stream's first frame, ascending
  std::vector<float> readings;    ///< [b, e]
  std::optional<double> rises_s;  ///< when an element's rest first rises by the onset in half a
                                  ///< second, as under a press that is longer than the window
  bool falls = false;             ///< the readings fall in presses

  /// Writes the rest at a time, [e]: interpolated, and constant beyond the first and last time.
  void at(double elapsed_s, std::vector<double>& rest) const;
};

/// Finds the rest of a drifting array from its whole stream, which may be touched at any time.
///
/// An element's rest is the morphological opening of its reading: the running minimum, and the
/// running maximum of this, over a window longer than a press. Linear drift passes an opening
/// unchanged; presses do not. Readings are means of 0.1 s of medians over three frames. The opening
/// lies low by their noise, so the mean by which the untouched array reads above it is added.
/// During a press the rest is a line from its value before to its value after.
///
/// Memory: a float for each element and tenth of a second. Time: O(1) for each of these.
class RestFinder {
 public:
  /// @param valid empty or [e]; 0 = dead element, whose rest is 0
  /// @param onset, release as in TouchDetectorOptions
  RestFinder(std::span<const std::uint8_t> valid, double onset, double release);

  /// Takes the stream's next frame; one that is_readable() refuses is ignored.
  void add(const Frame& frame);

  /// Returns the rest of the stream. Without `window_s` the window is the shortest of 2, 4, ... 32
  /// s that leaves no press in the rest, which is told by its steps, or else by far the fewest.
  Rest find(std::optional<double> window_s);

 private:
  struct Opened;

  bool is_alive(std::size_t element) const { return valid_.empty() || valid_[element] != 0; }
  void end_block();
  std::vector<float> column(std::size_t element, float sign) const;
  float low_by(std::span<const float> values, std::span<const float> rest,
               std::span<const float> above) const;
  Opened open(float sign, double window_s, std::span<const float> above,
              std::vector<float>* readings) const;
  Opened settle(float sign, double window_s, std::vector<float>* readings) const;
  double window_for(float sign) const;
  std::vector<float> departure(float sign, double window_s) const;
  bool falls() const;

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
