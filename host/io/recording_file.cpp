#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "file_format.hpp"
#include "hdf5_contents.hpp"
#include "hdf5_writer.hpp"
#include "input_file.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

using Shape = std::vector<std::uint64_t>;

// Datasets of a recording have to fit `pressure`.
struct Extent {
  std::uint64_t touches;
  std::uint64_t elements;
};

// The dataset's numbers, once its shape is one of those that fit.
std::vector<double> numbers_of(Hdf5Contents& file, const char* name, const Extent& extent,
                               const std::vector<Shape>& fitting) {
  Hdf5Value& value = file.dataset(name);
  if (std::find(fitting.begin(), fitting.end(), value.shape) == fitting.end()) {
    file.refuse(fmt::format("dataset '{}' has the shape {}; 'pressure' is [{}, {}], so make it {}",
                            name, value.shape, extent.touches, extent.elements,
                            fmt::join(fitting, " or ")));
  }
  return std::move(value.numbers);
}

// A stream that was cut off may have ended between two datasets: its rows are those that all of
// them have. `time` is written last, and what was not written is NaN.
void keep_whole_rows(Hdf5Contents& file) {
  const std::vector<std::string> names = {"pressure", "sensor_pose", "time", "device_time",
                                          "lost_before"};
  std::uint64_t rows = UINT64_MAX;
  for (const std::string& name : names) {
    if (file.has_dataset(name)) {
      const Hdf5Value& value = file.dataset(name);
      rows = std::min(rows, value.shape.empty() ? 0 : value.shape[0]);
    }
  }
  if (file.has_dataset("time")) {
    const std::vector<double>& time = file.dataset("time").numbers;
    const auto unwritten =
        std::find_if(time.begin(), time.end(), [](double t) { return std::isnan(t); });
    rows = std::min(rows, static_cast<std::uint64_t>(unwritten - time.begin()));
  }
  for (const std::string& name : names) {
    if (file.has_dataset(name)) {
      Hdf5Value& value = file.dataset(name);
      if (!value.shape.empty() && value.shape[0] > 0) {
        value.numbers.resize(value.numbers.size() / value.shape[0] * rows);
        value.shape[0] = rows;
      }
    }
  }
}

std::optional<Truth> read_truth(const Hdf5Contents& file) {
  if (!file.has_attribute("true_object") && !file.has_attribute("true_T_object_robot")) {
    return {};
  }
  const std::vector<double> pose = file.numbers("true_T_object_robot", 3);
  return Truth{file.text("true_object"), {{pose[0], pose[1]}, pose[2]}};
}

// What a stream of frames has besides.
void read_stream(Hdf5Contents& file, const Extent& extent, Recording& recording) {
  const auto [n, e] = extent;
  if (file.has_attribute("sensor")) {
    recording.sensor = file.text("sensor");
  }
  if (file.has_attribute("serial")) {
    recording.serial = file.text("serial");
  }
  if (file.has_dataset("baseline")) {
    recording.baseline = numbers_of(file, "baseline", extent, {{e}});
    if (std::all_of(recording.baseline.begin(), recording.baseline.end(),
                    [](double value) { return std::isnan(value); })) {
      recording.baseline.clear();  // the recording was cut off before it was taken
    }
  }
  if (file.has_dataset("device_time")) {
    recording.device_time_s = numbers_of(file, "device_time", extent, {{n}});
  }
  if (file.has_dataset("lost_before")) {
    for (const double lost : numbers_of(file, "lost_before", extent, {{n}})) {
      if (!(lost >= 0.0 && lost <= 1e15)) {
        file.refuse(fmt::format("dataset 'lost_before' holds {}; store counts of frames", lost));
      }
      recording.lost_before.push_back(static_cast<std::uint64_t>(lost));
    }
  }
}

void write_stream(Hdf5Writer& file, const Recording& recording) {
  if (!recording.sensor.empty()) {
    file.attribute("sensor", recording.sensor);
  }
  if (!recording.serial.empty()) {
    file.attribute("serial", recording.serial);
  }
  if (!recording.baseline.empty()) {
    file.dataset("baseline", {recording.baseline.size()}, recording.baseline);
  }
  if (!recording.device_time_s.empty()) {
    file.dataset("device_time", {recording.size()}, recording.device_time_s);
  }
  if (!recording.lost_before.empty()) {
    file.dataset("lost_before", {recording.size()}, recording.lost_before);
  }
}

void require_one_of(const std::filesystem::path& path, const char* attribute,
                    const std::string& value, const char* first, const char* second) {
  if (value != first && value != second) {
    refuse(path, fmt::format("attribute '{}' = '{}'; make it '{}' or '{}'", attribute, value, first,
                             second));
  }
}

// What holds for every recording, read or about to be written.
void validate(const std::filesystem::path& path, const Recording& recording) {
  const std::size_t n = recording.size();
  const std::size_t e = recording.elements();
  if (e == 0 || recording.pressure.size() != n * e) {
    refuse(path,
           fmt::format("dataset 'pressure': {} values for {} touches; store one per touch and "
                       "element",
                       recording.pressure.size(), n));
  }
  require_one_of(path, "pressure_unit", recording.pressure_unit, "kPa", "raw");
  require_one_of(path, "rows", recording.rows, "touches", "frames");
  for (std::size_t k = 0; k < recording.pressure.size(); ++k) {
    const std::size_t valid = recording.valid.size() == e ? k % e : k;
    const bool alive = recording.valid.empty() || recording.valid[valid] != 0;
    const bool unknown = recording.rows == "frames" && std::isnan(recording.pressure[k]);
    if (alive && !unknown && !std::isfinite(recording.pressure[k])) {
      refuse(path, fmt::format("dataset 'pressure'[{}, {}] = {}; store finite numbers, and 0 in "
                               "'valid' for a dead element",
                               k / e, k % e, recording.pressure[k]));
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    const Pose& pose = recording.T_robot_sensor[i];
    if (recording.rows == "frames" && std::isnan(pose.translation_mm.x) &&
        std::isnan(pose.translation_mm.y) && std::isnan(pose.theta_rad)) {
      continue;  // not known at that time
    }
    if (!std::isfinite(pose.translation_mm.x) || !std::isfinite(pose.translation_mm.y) ||
        !std::isfinite(pose.theta_rad)) {
      refuse(path, fmt::format("dataset 'sensor_pose'[{}] = [{}, {}, {}]; store finite numbers", i,
                               pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad));
    }
  }
  for (std::size_t k = 0; k < recording.elements_mm.size(); ++k) {
    const glm::dvec2& element = recording.elements_mm[k];
    if (!std::isfinite(element.x) || !std::isfinite(element.y)) {
      refuse(path, fmt::format("dataset 'elements', position {} = [{}, {}]; store finite numbers",
                               k, element.x, element.y));
    }
  }
  for (std::size_t i = 0; i < recording.baseline.size(); ++i) {
    if ((recording.valid.size() != e || recording.valid[i] != 0) &&
        !std::isfinite(recording.baseline[i])) {
      refuse(path, fmt::format("dataset 'baseline'[{}] = {}; store finite numbers", i,
                               recording.baseline[i]));
    }
  }
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    if (!std::isfinite(recording.time_s[i])) {
      refuse(path, fmt::format("dataset 'time'[{}] = {}; store seconds since the Unix epoch", i,
                               recording.time_s[i]));
    }
  }
}

}  // namespace

Recording read_recording(const std::filesystem::path& path) {
  Hdf5Contents file(path,
                    {"format", "version", "object", "pressure_unit", "length_unit", "rows",
                     "true_object", "true_T_object_robot", "sensor", "serial"},
                    {"pressure", "sensor_pose", "elements", "valid", "time", "baseline",
                     "device_time", "lost_before"});
  require_format(file, recording_format);
  if (const std::string unit = file.text("length_unit"); unit != "mm") {
    file.refuse(fmt::format("attribute 'length_unit' = '{}'; convert lengths to 'mm'", unit));
  }
  if (!file.closed()) {
    keep_whole_rows(file);
  }
  Recording recording;
  recording.closed = file.closed();
  recording.path = path.string();
  recording.object = file.text("object");
  recording.pressure_unit = file.text("pressure_unit");
  if (file.has_attribute("rows")) {
    recording.rows = file.text("rows");
  }
  recording.truth = read_truth(file);

  Hdf5Value& pressure = file.dataset("pressure", 2);
  const Extent extent{pressure.shape[0], pressure.shape[1]};
  const auto [n, e] = extent;
  if (n == 0 || e == 0) {
    file.refuse(
        fmt::format("dataset 'pressure' is empty, {}; record at least one touch by one "
                    "element",
                    pressure.shape));
  }
  recording.pressure = std::move(pressure.numbers);
  const std::vector<double> poses = numbers_of(file, "sensor_pose", extent, {{n, 3}});
  for (std::size_t i = 0; i < poses.size(); i += 3) {
    recording.T_robot_sensor.push_back({{poses[i], poses[i + 1]}, poses[i + 2]});
  }
  const std::vector<double> elements = numbers_of(file, "elements", extent, {{e, 2}, {n, e, 2}});
  for (std::size_t i = 0; i < elements.size(); i += 2) {
    recording.elements_mm.emplace_back(elements[i], elements[i + 1]);
  }
  if (file.has_dataset("valid")) {
    for (const double valid : numbers_of(file, "valid", extent, {{e}, {n, e}})) {
      if (std::isnan(valid)) {
        file.refuse("dataset 'valid' holds NaN; store 0 for a dead element and 1 for the others");
      }
      recording.valid.push_back(valid != 0);
    }
  }
  if (file.has_dataset("time")) {
    recording.time_s = numbers_of(file, "time", extent, {{n}});
  }
  read_stream(file, extent, recording);
  validate(path, recording);
  return recording;
}

void write_recording(const std::filesystem::path& path, const Recording& recording) {
  const std::size_t n = recording.size();
  const std::size_t e = recording.elements();
  const auto fits = [&](std::size_t count) { return count == e || count == n * e; };
  if (n * e == 0 || recording.pressure.size() != n * e || !fits(recording.elements_mm.size()) ||
      !(recording.valid.empty() || fits(recording.valid.size())) ||
      !(recording.time_s.empty() || recording.time_s.size() == n) ||
      !(recording.baseline.empty() || recording.baseline.size() == e) ||
      !(recording.device_time_s.empty() || recording.device_time_s.size() == n) ||
      !(recording.lost_before.empty() || recording.lost_before.size() == n)) {
    refuse(path,
           fmt::format("a recording of {} poses, {} pressures, {} elements, {} valid, {} "
                       "times, {} baseline values, {} device times and {} lost counts "
                       "cannot be written; make them agree",
                       n, recording.pressure.size(), recording.elements_mm.size(),
                       recording.valid.size(), recording.time_s.size(), recording.baseline.size(),
                       recording.device_time_s.size(), recording.lost_before.size()));
  }
  validate(path, recording);

  Hdf5Writer file(path);
  file.attribute("format", recording_format);
  file.attribute("version", format_version);
  file.attribute("object", recording.object);
  file.attribute("pressure_unit", recording.pressure_unit);
  file.attribute("length_unit", "mm");
  file.attribute("rows", recording.rows);
  if (recording.truth) {
    const Pose& pose = recording.truth->T_object_robot;
    file.attribute("true_object", recording.truth->object);
    file.attribute("true_T_object_robot",
                   {pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad});
  }
  const std::vector<float> narrow(recording.pressure.begin(), recording.pressure.end());
  const bool exact =
      std::equal(narrow.begin(), narrow.end(), recording.pressure.begin(),
                 [](float a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); });
  if (exact) {
    file.dataset("pressure", {n, e}, narrow);
  } else {
    file.dataset("pressure", {n, e}, recording.pressure);
  }
  std::vector<double> poses;
  for (const Pose& pose : recording.T_robot_sensor) {
    poses.insert(poses.end(), {pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad});
  }
  file.dataset("sensor_pose", {n, 3}, poses);
  std::vector<double> elements;
  for (const glm::dvec2& element : recording.elements_mm) {
    elements.insert(elements.end(), {element.x, element.y});
  }
  const bool constant_array = recording.elements_mm.size() == e;
  file.dataset("elements", constant_array ? Hdf5Writer::Shape{e, 2} : Hdf5Writer::Shape{n, e, 2},
               elements);
  if (!recording.valid.empty()) {
    const bool constant_valid = recording.valid.size() == e;
    file.dataset("valid", constant_valid ? Hdf5Writer::Shape{e} : Hdf5Writer::Shape{n, e},
                 recording.valid);
  }
  if (!recording.time_s.empty()) {
    file.dataset("time", {n}, recording.time_s);
  }
  write_stream(file, recording);
  file.save();
}

}  // namespace palpate
