#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "palpate/sensor.hpp"

namespace palpate {

/// When a stream of frames is a touch. Pressures are in the sensor's unit, above the baseline.
struct TouchDetectorOptions {
  double onset = 2.0;    ///< a touch begins where the largest pressure exceeds this
  double release = 1.0;  ///< and ends where it falls below this
  /// The steady phase: the array's summed pressure stays within this part of its median.
  double steady = 0.15;
  double min_steady_s = 0.1;  ///< shorter ones are no touch
};

/// One touch of a stream: a robust mean of its steady frames, one better reading than any of them.
struct DetectedTouch {
  double begin_s = 0.0;  ///< host times of the first and the last steady frame
  double end_s = 0.0;
  std::size_t frames = 0;                   ///< steady frames
  std::vector<double> pressure;             ///< [e] robust mean, above the baseline
  std::optional<Pose> T_robot_sensor = {};  ///< mean over the steady frames, where they have one
};

/// Finds touches in a stream of frames: onset, steady phase, release.
class TouchDetector {
 public:
  /// @param baseline [e] what the array reads when nothing is touched, subtracted from every frame;
  /// empty: nothing is subtracted
  /// @param valid empty or [e]; 0 = dead element, which takes no part
  /// @throws Error on options out of range or sizes that disagree
  TouchDetector(const TouchDetectorOptions& options, std::vector<double> baseline,
                std::vector<std::uint8_t> valid);

  /// Takes one frame; returns the touch that ends with it. @throws Error on a frame of another size
  std::optional<DetectedTouch> add(const Frame& frame);
  /// The touch under way when the stream ends, if it was steady long enough.
  std::optional<DetectedTouch> finish();

  bool touching() const;

 private:
  // to be designed
};

}  // namespace palpate
