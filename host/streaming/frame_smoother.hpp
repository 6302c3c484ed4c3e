#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace palpate {

/// Smooths frames, at the cost of a delay: per element, a median over the last three readings, then
/// the mean of these medians over `smooth_s`.
///
/// The mean depends, to the last bit, only on the readings in its window. NaN means Unknown: it
/// changes no median and takes no part in the mean. Where all of an element's window is Unknown,
/// the element keeps its last mean for `largest_gap_s` and is 0 from then on.
class FrameSmoother {
 public:
  /// @param smooth_s length of the mean's window
  /// @param largest_gap_s how long an Unknown element keeps its last mean
  FrameSmoother(double smooth_s, double largest_gap_s)
      : smooth_s_(smooth_s), largest_gap_s_(largest_gap_s) {}

  /// @param time_s not before the time of the last frame
  /// @param pressure [e] NaN for Unknown, else the difference of two readings that are is_known(),
  /// so that no sum overflows
  /// @return [e] the means, valid until the next call
  const std::vector<double>& add(double time_s, const std::vector<double>& pressure);
  /// [e] what the last add() returned; empty before it
  const std::vector<double>& means() const { return mean_; }
  /// Forgets every frame.
  void reset();

 private:
  /// Ring of an element's last known readings.
  struct Recent {
    std::array<double, 3> readings{};
    std::uint64_t count = 0;
    double last_s = 0.0;  ///< time of the last known reading
  };

  /// The medians of one frame.
  struct Medians {
    double time_s;
    std::vector<double> values;  ///< [e] NaN: Unknown
    bool whole;                  ///< no element is Unknown
  };

  void append(double time_s, const std::vector<double>& pressure);
  void take_means(double time_s);

  double smooth_s_;
  double largest_gap_s_;
  std::vector<Recent> recent_;  ///< [e]
  std::deque<Medians> window_;
  std::vector<std::vector<double>> spare_;  ///< memory for the next medians
  std::vector<double> sum_;                 ///< [e] of the window
  std::vector<double> known_;               ///< [e] known medians of frames that are not whole
  std::vector<double> mean_;                ///< [e]
};

}  // namespace palpate
