#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <utility>
#include <vector>

namespace palpate {

/// Frames without their noise, some frames late: per element the median of three frames in a row,
/// then the mean over a time.
class FrameSmoother {
 public:
  explicit FrameSmoother(double smooth_s) : smooth_s_(smooth_s) {}

  /// @param pressure [e], finite
  /// @return [e], until the next call
  const std::vector<double>& add(double time_s, const std::vector<double>& pressure);
  /// Forgets every frame.
  void reset();

 private:
  void append(double time_s);
  void drop_oldest();

  double smooth_s_;
  std::array<std::vector<double>, 3> recent_;                  ///< a ring
  std::size_t frames_ = 0;                                     ///< since reset()
  std::deque<std::pair<double, std::vector<double>>> window_;  ///< time and medians
  std::vector<std::vector<double>> spare_;                     ///< memory for the next medians
  std::vector<double> sum_;                                    ///< [e] of the window
  std::vector<double> mean_;                                   ///< [e]
};

}  // namespace palpate
