#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <utility>
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
  const std::vector<double>& add(double time_s, const std::vector<double>& pressure) {
    append(time_s, pressure);
    while (window_.size() > 1 &&
           (window_.size() > most_frames || window_.front().time_s <= time_s - smooth_s_)) {
      window_.pop_front();
    }
    take_means(time_s);
    return mean_;
  }

  /// [e] what the last add() returned; empty before it
  const std::vector<double>& means() const { return mean_; }
  /// Forgets every frame.
  void reset() {
    window_.clear();
    recent_.clear();
  }

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

  // Bounds memory and work where times do not advance; more frames would hardly improve the mean.
  static constexpr std::size_t most_frames = 256;

  static double median(double a, double b, double c) {
    return std::max(std::min(a, b), std::min(std::max(a, b), c));
  }

  void append(double time_s, const std::vector<double>& pressure) {
    const std::size_t e = pressure.size();
    recent_.resize(e);
    std::vector<double> middle(e, std::numeric_limits<double>::quiet_NaN());
    bool whole = true;
    for (std::size_t i = 0; i < e; ++i) {
      if (std::isnan(pressure[i])) {
        whole = false;
        continue;
      }
      Recent& recent = recent_[i];
      if (recent.count == 0) {
        recent.readings.fill(pressure[i]);  // stands in for the missing readings
      }
      recent.readings[recent.count++ % 3] = pressure[i];
      recent.last_s = time_s;
      middle[i] = median(recent.readings[0], recent.readings[1], recent.readings[2]);
    }
    window_.push_back({.time_s = time_s, .values = std::move(middle), .whole = whole});
  }

  // Sums anew for every frame: in a running sum, the rounding of a single reading of 1e20 would
  // exceed any pressure until the sensor is stopped.
  void take_means(double time_s) {
    const std::size_t e = recent_.size();
    sum_.assign(e, 0.0);
    known_.assign(e, 0.0);
    mean_.resize(e, 0.0);
    double whole = 0.0;
    for (const Medians& medians : window_) {
      if (medians.whole) {
        // Nearly all frames are whole; this loop takes a third of the other loop's time.
        for (std::size_t i = 0; i < e; ++i) {
          sum_[i] += medians.values[i];
        }
        whole += 1.0;
      } else {
        for (std::size_t i = 0; i < e; ++i) {
          const bool known = !std::isnan(medians.values[i]);
          sum_[i] += known ? medians.values[i] : 0.0;
          known_[i] += known ? 1.0 : 0.0;
        }
      }
    }
    for (std::size_t i = 0; i < e; ++i) {
      if (const double known = whole + known_[i]; known > 0.0) {
        mean_[i] = sum_[i] / known;
      } else if (recent_[i].count == 0 || time_s - recent_[i].last_s > largest_gap_s_) {
        mean_[i] = 0.0;
      }
    }
  }

  double smooth_s_;
  double largest_gap_s_;
  std::vector<Recent> recent_;  ///< [e]
  std::deque<Medians> window_;
  std::vector<double> sum_;    ///< [e] of the window
  std::vector<double> known_;  ///< [e] known medians of its frames that are not whole
  std::vector<double> mean_;   ///< [e]
};

}  // namespace palpate
