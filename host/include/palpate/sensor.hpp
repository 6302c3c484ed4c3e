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

#include "palpate/api.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// True for a finite reading that float32, the precision of recordings, holds. Any other reading
/// (NaN, infinite, too large) is Unknown: it says nothing about its element in this frame.
inline bool is_known(double reading) {
  return std::abs(reading) <= double{std::numeric_limits<float>::max()};
}

/// One reading of a whole array, as a sensor delivers it.
struct Frame {
  double host_time_s = 0.0;                  ///< time of arrival, since the Unix epoch
  std::optional<double> device_time_s = {};  ///< by the sensor's own clock, if any
  std::vector<double> values;                ///< [e] in the sensor's pressure unit; see is_known()
  std::uint64_t lost_before = 0;             ///< frames lost since the last frame
  std::optional<Pose> T_robot_sensor = {};   ///< known in replays, simulations and PosedSensor
};

/// True where the frame's time is finite and a living element has a known reading, or all elements
/// are dead. Any other frame counts as lost, and its readings do not count as Unknown.
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

/// Counts the Unknown readings of living elements in a readable frame; 0 for a frame that is not.
/// @param valid empty or [e]; 0 = dead element
inline std::size_t unknown_readings(const Frame& frame, std::span<const std::uint8_t> valid) {
  if (!is_readable(frame, valid)) {
    return 0;
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.values.size(); ++i) {
    count += (valid.empty() || valid[i] != 0) && !is_known(frame.values[i]) ? 1U : 0U;
  }
  return count;
}

/// Identity, geometry and units of a sensor.
struct SensorDescription {
  std::string name;                         ///< for people, such as "TakkTile"
  std::string serial;                       ///< "" if none
  std::string pressure_unit = "kPa";        ///< "kPa" or "raw"
  std::vector<glm::dvec2> elements_mm;      ///< [e] element centres in the sensor frame
  std::vector<std::uint8_t> valid = {};     ///< empty or [e]; 0 = dead element
  double rate_hz = 0.0;                     ///< frames per second, 0 if unknown
  std::vector<double> baseline = {};        ///< empty or [e]: untouched readings
  std::string object = {};                  ///< label of what it touches, "" if unknown
  std::optional<Truth> truth = {};          ///< known in simulations and their replays
  std::vector<SetupFinding> findings = {};  ///< of the recording that is replayed
};

/// Counts of what arrived and failed since start().
struct SensorCounters {
  std::uint64_t frames = 0;           ///< delivered by next() or waiting for it
  std::uint64_t lost = 0;             ///< frames dropped as next() came late, or missing
  std::uint64_t timeouts = 0;         ///< transfers that the host gave up
  std::uint64_t stalls = 0;           ///< halted endpoints, cleared
  std::uint64_t overflows = 0;        ///< packets larger than the endpoint allows
  std::uint64_t checksum_errors = 0;  ///< packets dropped for a wrong checksum
  std::uint64_t garbage_bytes = 0;    ///< bytes that belong to no packet
  std::uint64_t reconnects = 0;       ///< times the board was gone and came back
};

/// A stream of frames from a board, a file or a simulation. All calls come from one thread; a
/// sensor may read its hardware on threads of its own.
class PALPATE_API Sensor {
 public:
  virtual ~Sensor() = default;

  virtual const SensorDescription& description() const = 0;

  /// Starts the stream. @throws Error where the hardware refuses
  virtual void start() = 0;

  /// Returns the next frame; none where none comes within `timeout`, while gone(), and after
  /// ended(). A board drops the oldest frames that nobody takes and counts them in the next frame.
  /// @throws Error (Fault::system) where no frame can ever come again although the stream has not
  /// ended
  virtual std::optional<Frame> next(std::chrono::milliseconds timeout) = 0;

  /// True where no more frames will come: at the end of a replayed file.
  virtual bool ended() const { return false; }

  /// True while the board is unplugged; the sensor waits for it.
  virtual bool gone() const { return false; }

  /// Stops the stream; start() begins a new one.
  virtual void stop() = 0;

  virtual SensorCounters counters() const = 0;  ///< since start()
};

/// Takes a tare: returns what the untouched array reads, [e] in the sensor's pressure unit, as the
/// median of each element's known readings (see is_known()) over the frames; 0 for a dead element.
/// @param onset if given, the array counts as touched where the medians over the four quarters of
/// an element's readings differ by more than `onset`. This check needs 40 known readings, and
/// misses a touch that lasts through all frames.
/// @throws Error (Fault::input) on no frame, a frame of another size, an element without a known
/// reading, or a touched array
PALPATE_API std::vector<double> baseline_of(std::span<const Frame> frames,
                                            const SensorDescription& sensor,
                                            std::optional<double> onset);

}  // namespace palpate
