#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/pose.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Paces the frames of a sensor without a board by the stream's own times. Where these step back,
/// the next frame is due at once, and later frames at their distance from it.
class Pace {
 public:
  /// @param speed multiple of the stream's own time; none: every frame is due at once
  explicit Pace(std::optional<double> speed) : speed_(speed) {}

  /// Starts the stream now, at `stream_s` of its own time.
  void start(double stream_s) {
    last_s_ = stream_s;
    elapsed_s_ = 0.0;
    start_ = Clock::now();
  }

  /// Waits until a frame of time `stream_s` is due, at most for `timeout`. Returns false where it
  /// is not yet due: ask again.
  bool wait(double stream_s, std::chrono::milliseconds timeout) {
    if (!speed_) {
      return true;
    }
    const double elapsed_s = elapsed_s_ + std::max(0.0, stream_s - last_s_);
    const std::chrono::duration<double> from_start(elapsed_s / *speed_);
    const std::chrono::duration<double> left = from_start - (Clock::now() - start_);
    if (left > timeout) {
      std::this_thread::sleep_for(timeout);
      return false;
    }
    if (left.count() > 0.0) {
      std::this_thread::sleep_for(left);
    }
    last_s_ = stream_s;
    elapsed_s_ = elapsed_s;
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::optional<double> speed_;
  double last_s_ = 0.0;     ///< time of the last frame that was due
  double elapsed_s_ = 0.0;  ///< stream time up to that frame
  Clock::time_point start_;
};

/// What a simulated robot does: see open_virtual_sensor().
struct SimulatedSensorOptions {
  double rate_hz = 100.0;
  std::vector<glm::dvec2> elements_mm;  ///< in the sensor frame; empty: digitacts_array()
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> touches;  ///< none: without end
  double noise_kpa = 0.7;
  std::optional<Pose> T_object_robot;  ///< none: the object is known
  std::optional<double> speed = 1.0;   ///< times real time; none: at once
};

/// Simulates a robot that presses an array onto a shape again and again.
/// @throws Error where the shape is not known
std::unique_ptr<Sensor> make_simulated_sensor(const std::string& shape,
                                              const SimulatedSensorOptions& options);

}  // namespace palpate
