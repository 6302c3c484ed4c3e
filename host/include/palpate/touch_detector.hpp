#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Thresholds of the touch detector. Pressures are in the sensor's unit, above the baseline.
struct TouchDetectorOptions {
  double onset = 2.0;    ///< a touch begins where the largest pressure exceeds this
  double release = 1.0;  ///< a touch ends where it falls below this
  /// The load is the sum over elements of max(0, pressure - release). In a steady phase it differs
  /// from its mean by at most max(steady * mean, release).
  double steady = 0.15;
  double min_steady_s = 0.1;  ///< shortest steady phase of a touch
  double steady_mm = 0.5;     ///< a known pose moves less than this in a steady phase
  double steady_rad = 0.05;   ///< and turns less than this
  double smooth_s = 0.05;     ///< onset, release and load are judged on means over this time
  /// Longer than any press: what an element reads for so long is its baseline, which drifts; 0: the
  /// baseline is fixed.
  double drift_s = 10.0;
  double largest_gap_s = 0.5;  ///< a longer silence ends a touch
};

/// One touch of a stream: robust means over its longest steady phase.
struct DetectedTouch {
  double begin_s = 0.0;  ///< host times of the first and last frame averaged
  double end_s = 0.0;
  std::size_t frames = 0;                   ///< number of frames averaged
  std::vector<double> pressure;             ///< [e] interquartile mean, above the baseline
  std::vector<std::uint8_t> valid = {};     ///< [e] 0 = dead, or known in < 3 frames; reads 0
  std::optional<Pose> T_robot_sensor = {};  ///< mean of the known poses
};

/// Finds touches in a stream of frames by onset, steady phase and release.
///
/// Each element's pressure passes a median over three frames, so that single bad frames neither
/// begin nor end a touch, and a mean over `smooth_s`; onset, release and load are judged on the
/// result. The longest steady phase of a touch becomes one reading: per element, the interquartile
/// mean of the phase's pressures, which tolerates a quarter of wrong frames to either side.
///
/// Readings that are not is_known() take no part in medians and means. An element that is Unknown
/// for longer than `largest_gap_s` counts as untouched until it can be read again. Wild readings
/// have no effect on later touches.
///
/// While nothing is touched, the baseline follows the readings with a time constant of a second;
/// they count as at most `onset` below it. Where the array reads above the release for longer than
/// `drift_s`, through presses and what lies between them, drift has overtaken the baseline, which
/// becomes the lower quintile of what each element read meanwhile: a press that is held for longer
/// ends then. Lost frames only coarsen the times of a touch. A silence longer than `largest_gap_s`,
/// or a clock that goes back, ends a touch and restarts detection. Memory is bounded: a long steady
/// phase keeps frames evenly spread over it. Every call on a moved-from detector throws Error.
class PALPATE_API TouchDetector {
 public:
  /// @param baseline [e] what the untouched array reads, subtracted from every frame; empty: zeros
  /// @param valid empty or [e]; 0 = dead element, which takes no part and reads 0 in every touch
  /// @throws Error on options out of range, a baseline that is not is_known(), or sizes that
  /// disagree
  TouchDetector(const TouchDetectorOptions& options, std::vector<double> baseline,
                std::vector<std::uint8_t> valid);
  ~TouchDetector();
  TouchDetector(TouchDetector&&) noexcept;
  TouchDetector& operator=(TouchDetector&&) noexcept;

  /// Takes one frame and returns the touch that ends with it, if any. A frame without a known
  /// reading, or with a time that is not finite, is ignored; a pose that is_robot_pose() refuses is
  /// unknown.
  /// @throws Error on a frame of another size than the one before
  std::optional<DetectedTouch> add(const Frame& frame);
  /// Ends the stream: returns the touch under way, if it was steady long enough, and restarts
  /// detection.
  std::optional<DetectedTouch> finish();

  /// True between onset and release.
  bool touching() const;
  /// Returns the smoothed pressures of the last frame, [e] above the baseline, on which onset and
  /// release are judged; empty before the first frame.
  const std::vector<double>& smoothed() const;
  /// Returns the present baseline, [e]; empty before the first frame where none was given.
  const std::vector<double>& baseline() const;

 private:
  struct PALPATE_LOCAL Impl;
  PALPATE_LOCAL Impl& impl() const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
