#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

#include "palpate/touch.hpp"

namespace palpate {

/// A recording without its rows, as a file announces it.
struct RecordingHead {
  Recording recording;         ///< its texts, truth, `valid`, `baseline` and `closed`
  std::uint64_t rows = 0;      ///< n
  std::uint64_t elements = 0;  ///< e
  bool array_changes = false;  ///< `elements` is [n, e, 2]
};

/// Called with a recording's rows, which come in pieces, one dataset after the other.
struct RecordingTakers {
  std::function<void(const RecordingHead&)> head;  ///< before any row
  std::function<void(std::span<const double>)> pressure;
  std::function<void(std::span<const Pose>)> T_robot_sensor;
  std::function<void(std::span<const glm::dvec2>)> elements_mm;
  std::function<void(std::span<const double>)> time_s;
  std::function<void(std::span<const double>)> device_time_s;
  std::function<void(std::span<const std::uint64_t>)> lost_before;
};

/// Reads and checks a "palpate.recording" HDF5 file as Hdf5Contents does, holding a few MB of it at
/// a time.
/// @throws Error as read_recording() does
void scan_recording(const std::filesystem::path& path, const RecordingTakers& takers);

}  // namespace palpate
