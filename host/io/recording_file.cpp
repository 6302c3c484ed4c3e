#include "io/recording_file.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "io/file_format.hpp"
#include "io/hdf5_contents.hpp"
#include "io/hdf5_writer.hpp"
#include "io/recording_rules.hpp"
#include "model/number_text.hpp"
#include "model/stream_time.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

using Shape = std::vector<std::uint64_t>;

std::optional<Truth> read_truth(const Hdf5Contents& file) {
  if (!file.has_attribute("true_object") && !file.has_attribute("true_T_object_robot")) {
    return {};
  }
  const std::vector<double> pose = file.numbers("true_T_object_robot", 3);
  return Truth{file.text("true_object"), {{pose[0], pose[1]}, pose[2]}};
}

std::vector<SetupFinding> read_findings(const Hdf5Contents& file) {
  if (!file.has_attribute("findings")) {
    return {};
  }
  std::vector<SetupFinding> findings;
  const auto all = nlohmann::json::parse(file.text("findings"), nullptr, false);
  try {
    for (const nlohmann::json& one : all.get<nlohmann::json::array_t>()) {
      findings.push_back({one.at("what"), one.at("nats"), one.at("words")});
      const std::string options = one.at("option");
      if (!options.empty()) {
        const auto parts = split_text(options, ';');
        findings.back().options.assign(parts.begin(), parts.end());
      }
    }
  } catch (const nlohmann::json::exception&) {
    file.refuse("attribute 'findings' is no JSON array of what, nats, words and option; delete it");
  }
  return findings;
}

// Checks the sizes of a recording that is about to be written.
void require_agreement(const std::filesystem::path& path, const Recording& recording,
                       std::size_t e) {
  const std::size_t n = recording.size();
  const auto of_array = [&](std::size_t count) { return count == e || count == n * e; };
  const auto of_rows = [&](std::size_t count) { return count == 0 || count == n; };
  if (n * e == 0 || !(recording.pressure.empty() || recording.pressure.size() == n * e) ||
      !of_array(recording.elements_mm.size()) ||
      !(recording.valid.empty() || of_array(recording.valid.size())) ||
      !(recording.baseline.empty() || recording.baseline.size() == e) ||
      !of_rows(recording.time_s.size()) || !of_rows(recording.device_time_s.size()) ||
      !of_rows(recording.lost_before.size())) {
    refuse(path,
           "a recording of {} poses, {} pressures, {} elements, {} valid, {} times, {} baseline "
           "values, {} device times and {} lost counts cannot be written; make them agree",
           n, recording.pressure.size(), recording.elements_mm.size(), recording.valid.size(),
           recording.time_s.size(), recording.baseline.size(), recording.device_time_s.size(),
           recording.lost_before.size());
  }
}

}  // namespace

RecordingFile::RecordingFile(const std::filesystem::path& path)
    : path_(path),
      file_(std::make_unique<Hdf5Contents>(
          path,
          std::vector<std::string>{"format", "version", "object", "pressure_unit", "length_unit",
                                   "rows", "true_object", "true_T_object_robot", "sensor", "serial",
                                   "findings"},
          std::vector<std::string>{"pressure", "sensor_pose", "elements", "valid", "time",
                                   "baseline", "device_time", "lost_before"})) {
  read_texts();
  read_extents();
  read_elements();
  require_head(path_, head_.recording, head_.elements);
}

RecordingFile::~RecordingFile() = default;

void RecordingFile::read_texts() {
  require_format(*file_, recording_format);
  if (const std::string unit = file_->text("length_unit"); unit != "mm") {
    file_->refuse("attribute 'length_unit' = '{}'; convert lengths to 'mm'", unit);
  }
  Recording& r = head_.recording;
  r.closed = file_->closed();
  r.path = path_.string();
  r.object = file_->text("object");
  r.pressure_unit = file_->text("pressure_unit");
  for (const auto& [name, text] :
       {std::pair{"rows", &r.rows}, {"sensor", &r.sensor}, {"serial", &r.serial}}) {
    if (file_->has_attribute(name)) {
      *text = file_->text(name);
    }
  }
  r.truth = read_truth(*file_);
  r.findings = read_findings(*file_);
}

/// The complete rows of a stream that is being recorded or was cut off: the rows that all datasets
/// have and whose time, which is written last, is not NaN.
std::uint64_t RecordingFile::complete_rows() const {
  std::uint64_t rows = UINT64_MAX;
  for (const char* name : row_names) {
    if (file_->has_dataset(name)) {
      const Shape& shape = file_->shape(name);
      rows = std::min(rows, shape.empty() ? 0 : shape[0]);
    }
  }
  std::uint64_t written = rows;
  if (file_->has_dataset("time") && file_->shape("time").size() == 1) {
    const auto take = [&](std::uint64_t first, std::span<const double> times) {
      const auto nan = std::ranges::find_if(times, [](double t) { return std::isnan(t); });
      if (nan != times.end()) {
        written = std::min(written, first + static_cast<std::uint64_t>(nan - times.begin()));
      }
    };
    file_->read("time", take, 0, rows);
  }
  return written;
}

void RecordingFile::read_extents() {
  if (!file_->closed()) {
    rows_ = complete_rows();
  }
  file_->shape("pressure", 2);
  const Shape pressure = shape_of("pressure");
  const std::uint64_t n = head_.rows = pressure[0];
  const std::uint64_t e = head_.elements = pressure[1];
  if (n == 0 || e == 0) {
    file_->refuse("dataset 'pressure' is empty, {}; record at least one touch by one element",
                  pressure);
  }
  if (head_.recording.rows != "frames") {
    file_->shape("sensor_pose");  // which only frames may lack
  }
  has("sensor_pose", {{n, 3}});
  file_->shape("elements");
  has("elements", {{e, 2}, {n, e, 2}});
  head_.array_changes = file_->shape("elements").size() == 3;
  for (const char* name : {"time", "device_time", "lost_before"}) {
    has(name, {{n}});
  }
}

/// Reads what is small: the lists of elements.
void RecordingFile::read_elements() {
  Recording& r = head_.recording;
  const auto [n, e] = std::pair{head_.rows, head_.elements};
  if (has("valid", {{e}, {n, e}})) {
    r.valid.reserve(file_->size("valid"));
    file_->read("valid", [&](std::uint64_t, std::span<const double> values) {
      for (const double valid : values) {
        if (std::isnan(valid)) {
          file_->refuse(
              "dataset 'valid' holds NaN; store 0 for a dead element and 1 for the others");
        }
        r.valid.push_back(valid != 0);
      }
    });
  }
  if (has("baseline", {{e}})) {
    r.baseline = file_->read<double>("baseline");
    // A NaN in the baseline of a stream: the recording was cut off before the baseline was known.
    for (std::uint64_t k = 0; r.rows == "frames" && k < r.baseline.size(); ++k) {
      if ((r.valid.size() != e || r.valid[k] != 0) && std::isnan(r.baseline[k])) {
        r.baseline.clear();
      }
    }
  }
  if (!head_.array_changes) {
    r.elements_mm = file_->read<glm::dvec2>("elements");
    require_elements(path_, 0, r.elements_mm);
  }
}

void RecordingFile::read(std::uint64_t first, std::uint64_t count, Recording& rows) const {
  const auto read_list = [&]<typename Value>(const char* name, std::vector<Value>& list) {
    list = std::vector<Value>();  // frees the rows before
    if (file_->has_dataset(name)) {
      list = file_->read<Value>(name, first, count);
    }
  };
  read_list("pressure", rows.pressure);
  read_list("sensor_pose", rows.T_robot_sensor);
  if (!file_->has_dataset("sensor_pose")) {
    rows.T_robot_sensor.assign(count, unknown_pose);  // a stream without poses
  }
  if (head_.array_changes) {
    read_list("elements", rows.elements_mm);
  }
  read_list("time", rows.time_s);
  read_list("device_time", rows.device_time_s);
  rows.lost_before.clear();
  const auto take_lost = [&](std::uint64_t, std::span<const double> values) {
    for (const double value : values) {
      if (!(value >= 0.0 && value <= static_cast<double>(largest_count) &&
            value == std::floor(value))) {
        file_->refuse("dataset 'lost_before' holds {}; store counts of frames up to {}", value,
                      largest_count);
      }
      rows.lost_before.push_back(static_cast<std::uint64_t>(value));
    }
  };
  if (file_->has_dataset("lost_before")) {
    rows.lost_before.reserve(file_->size("lost_before", first, count));
    file_->read("lost_before", take_lost, first, count);
  }
  require_rows(path_, head_.recording, head_.elements, rows, first);
}

/// The dataset's shape without incomplete rows.
Shape RecordingFile::shape_of(const char* name) const {
  Shape shape = file_->shape(name);
  if (std::ranges::find(row_names, std::string_view(name)) != std::end(row_names) &&
      !shape.empty()) {
    shape[0] = std::min(shape[0], rows_);
  }
  return shape;
}

/// Whether the file has the dataset. Throws Error where its shape does not fit.
bool RecordingFile::has(const char* name, const std::vector<Shape>& fitting) const {
  if (!file_->has_dataset(name)) {
    return false;
  }
  if (const Shape shape = shape_of(name); std::ranges::find(fitting, shape) == fitting.end()) {
    file_->refuse("dataset '{}' has the shape {}; 'pressure' is [{}, {}], so make it {}", name,
                  shape, head_.rows, head_.elements, fmt::format("{}", fmt::join(fitting, " or ")));
  }
  return true;
}

Recording read_recording(const std::filesystem::path& path) {
  const RecordingFile file(path);
  Recording recording = file.head().recording;
  file.read(0, file.head().rows, recording);
  return recording;
}

void write_recording(const std::filesystem::path& path, const Recording& recording) {
  const std::size_t e = recording.elements();
  const std::size_t n = recording.size();
  const bool narrow = std::ranges::all_of(
      recording.pressure, [](double p) { return static_cast<float>(p) == p || std::isnan(p); });
  require_agreement(path, recording, e);
  require_head(path, recording, e);
  require_rows(path, recording, e, recording, 0);

  constexpr std::size_t head = 1 << 16;
  const std::size_t lists = recording.time_s.size() + recording.baseline.size() +
                            recording.device_time_s.size() + recording.lost_before.size();
  Hdf5Writer file(path, Hdf5Writer::Layout::closed,
                  head + recording.pressure.size() * (narrow ? sizeof(float) : sizeof(double)) +
                      n * sizeof(Pose) + recording.elements_mm.size() * sizeof(glm::dvec2) +
                      recording.valid.size() + lists * sizeof(double));
  write_head(file, recording);
  file.dataset("pressure", {n, e}, recording.pressure,
               narrow ? Hdf5Writer::Storage::narrow : Hdf5Writer::Storage::plain);
  if (recording.rows != "frames" || std::ranges::any_of(recording.T_robot_sensor, is_finite)) {
    file.dataset("sensor_pose", {n, 3}, recording.T_robot_sensor);
  }
  const bool array_changes = recording.elements_mm.size() != e;
  file.dataset("elements", array_changes ? Hdf5Writer::Shape{n, e, 2} : Hdf5Writer::Shape{e, 2},
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
