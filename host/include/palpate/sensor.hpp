#pragma once

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Whether an element's reading is a number that float32 holds, as recordings do. Every other
/// reading, NaN, an infinity or a larger number, is Unknown: it says nothing about the element in
/// its frame.
inline bool is_known(double reading) {
  return std::abs(reading) <= double{std::numeric_limits<float>::max()};
}

/// One reading of a whole array, as a sensor delivers it.
struct Frame {
  double host_time_s = 0.0;                  ///< when it arrived, since the Unix epoch
  std::optional<double> device_time_s = {};  ///< by the sensor's own clock, where it has one
  std::vector<double> values;                ///< [e] in the sensor's pressure unit; see is_known()
  std::uint64_t lost_before = 0;             ///< frames lost since the one before
  std::optional<Pose> T_robot_sensor = {};   ///< where the source knows it: replays and simulations
};

/// Whether a frame says anything: an element that is alive has a known reading, or all are dead,
/// and its time is finite. Every other frame counts as a lost frame, and its readings do not count
/// as unknown ones.
/// @param valid empty or [e]; 0 = dead element
inline bool is_readable(const Frame& frame, std::span<const std::uint8_t> valid) {
  bool any_alive = false;
  bool any_known = false;
  for (std::size_t i = 0; i < frame.values.size(); ++i) {
    const bool alive = valid.empty() || valid[i] != 0;
    any_alive = any_alive || alive;
    any_known = any_known || (alive && is_known(frame.values[i]));
  }
  return (any_known || !any_alive) && std::isfinite(frame.host_time_s);
}

/// How many readings of a frame that is_readable() are Unknown; 0 of another. Dead elements do not
/// count.
/// @param valid empty or [e]; 0 = dead element
inline std::size_t unknown_readings(const Frame& frame, std::span<const std::uint8_t> valid) {
  if (!is_readable(frame, valid)) {
    return 0;
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.values.size(); ++i) {
    count += (valid.empty() || valid[i] != 0) && !is_known(frame.values[i]) ? 1 : 0;
  }
  return count;
}

/// What a sensor is.
struct SensorDescription {
  std::string name;                      ///< such as "TakkTile", for people
  std::string serial;                    ///< "" where it has none
  std::string pressure_unit = "kPa";     ///< "kPa" or "raw"
  std::vector<glm::dvec2> elements_mm;   ///< [e] element centres in the sensor frame
  std::vector<std::uint8_t> valid = {};  ///< empty or [e]; 0 = dead element
  double rate_hz = 0.0;                  ///< frames per second, 0 where that is not known
  std::vector<double> baseline = {};     ///< empty or [e]: what it reads untouched, where known
  std::string object = {};               ///< what it is touching, "" when unknown
  std::optional<Truth> truth = {};       ///< of an unknown, in simulations and replays of them
};

/// What happened on the way from the sensor since start().
struct SensorCounters {
  std::uint64_t frames = 0;           ///< delivered by next() or waiting for it
  std::uint64_t lost = 0;             ///< dropped because next() was not called in time, or missing
  std::uint64_t timeouts = 0;         ///< transfers that the host gave up
  std::uint64_t stalls = 0;           ///< halted endpoints, cleared
  std::uint64_t overflows = 0;        ///< packets larger than the endpoint allows
  std::uint64_t checksum_errors = 0;  ///< packets dropped for that
  std::uint64_t garbage_bytes = 0;    ///< bytes that belong to no packet
  std::uint64_t reconnects = 0;       ///< times the board was gone and came back
};

/// A stream of frames from a board, a file or a simulation. Used from one thread; it is not
/// specified from which threads a sensor reads its hardware.
class Sensor {
 public:
  virtual ~Sensor() = default;

  virtual const SensorDescription& description() const = 0;

  /// Frames arrive from here on. @throws Error where the hardware refuses.
  virtual void start() = 0;

  /// The next frame, or none within `timeout`: not yet, gone for the moment, or ended(). Frames
  /// that nobody takes are dropped from the oldest on and counted with the next one.
  /// @throws Error (Fault::system) where no frame will ever come again although it has not ended
  virtual std::optional<Frame> next(std::chrono::milliseconds timeout) = 0;

  /// No more frames will come: the end of a replayed file.
  virtual bool ended() const { return false; }

  /// The board is unplugged and waited for.
  virtual bool gone() const { return false; }

  /// Frames stop; start() begins anew.
  virtual void stop() = 0;

  virtual SensorCounters counters() const = 0;
};

}  // namespace palpate
