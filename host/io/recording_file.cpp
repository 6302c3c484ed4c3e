#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "io/file_format.hpp"
#include "io/hdf5_writer.hpp"
#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "io/recording_scan.hpp"
#include "io/stored_bytes.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

template <typename Value>
void append(std::vector<Value>& list, std::span<const Value> more) {
  list.insert(list.end(), more.begin(), more.end());
}

void reserve(const RecordingHead& head, Recording& recording) {
  const std::uint64_t readings = stored_bytes(std::array{head.rows, head.elements}, 1);
  recording.pressure.reserve(readings);
  recording.T_robot_sensor.reserve(head.rows);
  recording.elements_mm.reserve(head.array_changes ? readings : head.elements);
}

// Checks the sizes of a recording that is about to be written.
void require_agreement(const std::filesystem::path& path, const Recording& recording,
                       std::size_t e) {
  const std::size_t n = recording.size();
  const auto fits = [&](std::size_t count) { return count == e || count == n * e; };
  if (n * e == 0 || !(recording.pressure.empty() || recording.pressure.size() == n * e) ||
      !fits(recording.elements_mm.size()) ||
      !(recording.valid.empty() || fits(recording.valid.size())) ||
      !(recording.time_s.empty() || recording.time_s.size() == n) ||
      !(recording.baseline.empty() || recording.baseline.size() == e) ||
      !(recording.device_time_s.empty() || recording.device_time_s.size() == n) ||
      !(recording.lost_before.empty() || recording.lost_before.size() == n)) {
    refuse(path,
           "a recording of {} poses, {} pressures, {} elements, {} valid, {} times, {} baseline "
           "values, {} device times and {} lost counts cannot be written; make them agree",
           n, recording.pressure.size(), recording.elements_mm.size(), recording.valid.size(),
           recording.time_s.size(), recording.baseline.size(), recording.device_time_s.size(),
           recording.lost_before.size());
  }
}

}  // namespace

Recording read_recording(const std::filesystem::path& path) {
  Recording recording;
  scan_recording(path,
                 {.head =
                      [&](const RecordingHead& head) {
                        recording = head.recording;
                        reserve(head, recording);
                      },
                  .pressure = [&](auto values) { append(recording.pressure, values); },
                  .T_robot_sensor = [&](auto poses) { append(recording.T_robot_sensor, poses); },
                  .elements_mm = [&](auto places) { append(recording.elements_mm, places); },
                  .time_s = [&](auto times) { append(recording.time_s, times); },
                  .device_time_s = [&](auto times) { append(recording.device_time_s, times); },
                  .lost_before = [&](auto counts) { append(recording.lost_before, counts); }});
  return recording;
}

void write_recording(const std::filesystem::path& path, const Recording& recording) {
  const std::size_t e = recording.elements();
  const bool narrow =
      std::all_of(recording.pressure.begin(), recording.pressure.end(),
                  [](double p) { return static_cast<float>(p) == p || std::isnan(p); });
  require_agreement(path, recording, e);
  const std::size_t n = recording.size();
  require_head(path, recording, e);
  require_pressures(path, recording, e, 0, recording.pressure);
  require_poses(path, recording, 0, recording.T_robot_sensor);
  require_elements(path, 0, recording.elements_mm);
  require_times(path, 0, recording.time_s);
  require_device_times(path, 0, recording.device_time_s);
  require_lost_counts(path, 0, recording.lost_before);

  constexpr std::size_t head = 1 << 16;
  const std::size_t row =
      e * (narrow ? sizeof(float) : sizeof(double)) + sizeof(Pose) + sizeof(double);
  Hdf5Writer file(path, Hdf5Writer::Layout::closed, n * row + head);
  write_head(file, recording);
  file.dataset("pressure", {n, e}, recording.pressure,
               narrow ? Hdf5Writer::Storage::narrow : Hdf5Writer::Storage::plain);
  if (recording.rows != "frames" ||
      std::any_of(recording.T_robot_sensor.begin(), recording.T_robot_sensor.end(), is_finite)) {
    file.dataset("sensor_pose", {n, 3}, recording.T_robot_sensor);
  }
  const bool constant_array = recording.elements_mm.size() == e;
  file.dataset("elements", constant_array ? Hdf5Writer::Shape{e, 2} : Hdf5Writer::Shape{n, e, 2},
               recording.elements_mm);
  if (!recording.valid.empty()) {
    const bool constant_valid = recording.valid.size() == e;
    file.dataset("valid", constant_valid ? Hdf5Writer::Shape{e} : Hdf5Writer::Shape{n, e},
                 recording.valid);
  }
  const auto write_list = [&](const char* name, const auto& values) {
    if (!values.empty()) {
      file.dataset(name, {values.size()}, values);
    }
  };
  write_list("time", recording.time_s);
  write_list("baseline", recording.baseline);
  write_list("device_time", recording.device_time_s);
  write_list("lost_before", recording.lost_before);
  file.save();
}

}  // namespace palpate
