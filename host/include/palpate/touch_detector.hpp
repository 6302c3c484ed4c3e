#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// When a stream of frames is a touch. Pressures are in the sensor's unit, above the baseline.
struct TouchDetectorOptions {
  double onset = 2.0;    ///< a touch begins where the largest pressure exceeds this
  double release = 1.0;  ///< and ends where it falls below this
  /// In the steady phase the load, the sum of what every element reads above `release`, stays
  /// within this part of its mean, or within `release` where that is more.
  double steady = 0.15;
  double min_steady_s = 0.1;  ///< shorter ones are no touch
  double steady_mm = 0.5;     ///< a pose that is known moves less than this in the steady phase
  double steady_rad = 0.05;   ///< and turns less than this
  double smooth_s = 0.05;     ///< onset, release and load are judged by the mean over this time
  /// Time constant with which the baseline follows what is read while nothing is touched; 0: never.
  double drift_s = 60.0;
  double largest_gap_s = 0.5;  ///< a longer silence ends a touch
};

/// One touch of a stream: a robust mean of its steady frames, one better reading than any of them.
struct DetectedTouch {
  double begin_s = 0.0;  ///< host times of the first and the last of its frames
  double end_s = 0.0;
  std::size_t frames = 0;                   ///< that the means are of
  std::vector<double> pressure;             ///< [e] interquartile mean, above the baseline
  std::vector<std::uint8_t> valid = {};     ///< [e] 0 = dead, or Unknown in its frames; it reads 0
  std::optional<Pose> T_robot_sensor = {};  ///< mean of those that are known
};

/// Finds touches in a stream of frames: onset, steady phase, release.
///
/// Of every three frames in a row each element's median is taken, so that single bad frames neither
/// begin nor end a touch, then the mean over `smooth_s`. A touch's longest steady phase becomes one
/// reading: per element the interquartile mean of its frames. Unlike the median it resolves less
/// than a step of the sensor's converter and averages noise almost as well as the mean (84 %
/// against 64 % of its efficiency); and a quarter of the frames may be wrong to either side.
///
/// A reading that is_known() does not know changes nothing: the touch is found by the others, and
/// the means are of the readings that are known. An element that is Unknown for longer than
/// `largest_gap_s` counts as untouched until it can be read again. Whatever finite numbers an
/// element reads, they leave no trace in the touches after them.
///
/// While nothing is touched the baseline follows slow drift, of what is read below it by at most
/// `onset` in `drift_s`. Lost frames do no harm beyond what
/// they do to the time a touch is seen; a silence longer than `largest_gap_s`, or a clock that goes
/// back, ends a touch and begins anew. The memory in use is bounded: of a long steady phase, frames
/// evenly spread over it are kept. A detector that was moved from throws Error whatever it is
/// asked.
class TouchDetector {
 public:
  /// @param baseline [e] what the array reads when nothing is touched, subtracted from every frame;
  /// empty: it reads nothing
  /// @param valid empty or [e]; 0 = dead element, which takes no part and reads 0 in every touch
  /// @throws Error on options out of range, a baseline that is_known() refuses or sizes that
  /// disagree
  TouchDetector(const TouchDetectorOptions& options, std::vector<double> baseline,
                std::vector<std::uint8_t> valid);
  ~TouchDetector();
  TouchDetector(TouchDetector&&) noexcept;
  TouchDetector& operator=(TouchDetector&&) noexcept;

  /// Takes one frame; returns the touch that ends with it. A frame without a known reading, or with
  /// a time that is not finite, is passed over; a pose that is_robot_pose() refuses is not known.
  /// @throws Error on a frame of another size than the one before
  std::optional<DetectedTouch> add(const Frame& frame);
  /// The touch under way when the stream ends, if it was steady long enough; begins anew.
  std::optional<DetectedTouch> finish();

  /// The touch that the next release will end, unless a longer steady phase comes before; empty
  /// where no steady phase is over yet. It changes with add() and finish() alone.
  const std::optional<DetectedTouch>& candidate() const;
  /// Between onset and release.
  bool touching() const;
  /// [e] what the array reads untouched by now; empty before the first frame where none was given.
  const std::vector<double>& baseline() const;

 private:
  struct Impl;
  Impl& impl() const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
