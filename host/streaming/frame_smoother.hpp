#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace palpate {

/// Frames without their noise, some frames late: per element the median of its last three readings,
/// then the mean of these medians over a time.
///
/// The mean depends on the readings in its window alone, to the last bit: whatever an element has
/// read leaves no trace once it has left the window. A reading of NaN is Unknown: it changes no
/// median and takes no part in the mean. Where the window holds nothing else, an element keeps its
/// last mean for `largest_gap_s` and is 0 from then on.
class FrameSmoother {
 public:
  /// @param smooth_s time that the mean is over
  /// @param largest_gap_s how long an element that is Unknown keeps its last mean
  FrameSmoother(double smooth_s, double largest_gap_s)
      : smooth_s_(smooth_s), largest_gap_s_(largest_gap_s) {}

  /// @param time_s not before the time of the last frame
  /// @param pressure [e] the differences of two readings that is_known() knows, or NaN: Unknown.
  /// So no sum overflows.
  /// @return [e], until the next call
  const std::vector<double>& add(double time_s, const std::vector<double>& pressure);
  /// Forgets every frame.
  void reset();

 private:
  /// The last readings of an element that are known: a ring.
  struct Recent {
    std::array<double, 3> readings{};
    std::uint64_t count = 0;
    double last_s = 0.0;  ///< when the last of them came
  };

  /// Of one frame.
  struct Medians {
    double time_s;
    std::vector<double> values;  ///< [e] NaN: Unknown
    bool whole;                  ///< none is Unknown
  };

  void append(double time_s, const std::vector<double>& pressure);
  void take_means(double time_s);

  double smooth_s_;
  double largest_gap_s_;
  std::vector<Recent> recent_;  ///< [e]
  std::deque<Medians> window_;
  std::vector<std::vector<double>> spare_;  ///< memory for the next medians
  std::vector<double> sum_;                 ///< [e] of the window
  std::vector<double> known_;               ///< [e] how many of its frames that are not whole count
  std::vector<double> mean_;                ///< [e]
};

}  // namespace palpate
