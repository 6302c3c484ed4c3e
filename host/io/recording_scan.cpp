#include "io/recording_scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "io/file_format.hpp"
#include "io/hdf5_contents.hpp"
#include "io/recording_rules.hpp"
#include "io/stored_bytes.hpp"
#include "model/number_text.hpp"
#include "model/stream_time.hpp"

namespace palpate {

namespace {

using Shape = std::vector<std::uint64_t>;

// Returns the complete rows of a stream that is being recorded or was cut off: the rows that all
// datasets have and whose time, which is written last, is not NaN.
std::uint64_t whole_rows(Hdf5Contents& file) {
  std::uint64_t rows = UINT64_MAX;
  for (const char* name : row_names) {
    if (file.has_dataset(name)) {
      const Shape& shape = file.shape(name);
      rows = std::min(rows, shape.empty() ? 0 : shape[0]);
    }
  }
  if (file.has_dataset("time") && file.shape("time").size() == 1) {
    std::uint64_t written = UINT64_MAX;
    file.read(
        "time",
        [&](std::uint64_t first, std::span<const double> times) {
          const auto unwritten =
              std::find_if(times.begin(), times.end(), [](double t) { return std::isnan(t); });
          if (unwritten != times.end()) {
            written =
                std::min(written, first + static_cast<std::uint64_t>(unwritten - times.begin()));
          }
        },
        rows);
    rows = std::min(rows, written);
  }
  return rows;
}

const std::vector<std::string> attribute_names = {
    "format",      "version", "object",      "pressure_unit",
    "length_unit", "rows",    "true_object", "true_T_object_robot",
    "sensor",      "serial",  "findings"};
const std::vector<std::string> dataset_names = {"pressure",    "sensor_pose", "elements",
                                                "valid",       "time",        "baseline",
                                                "device_time", "lost_before"};

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

class Scan {
 public:
  Scan(const std::filesystem::path& path, const RecordingTakers& takers)
      : path_(path), takers_(takers), file_(path, attribute_names, dataset_names) {}

  void run() {
    read_texts();
    read_extents();
    read_small_lists();
    require_head(path_, head_.recording, head_.elements);
    takers_.head(head_);
    read_rows();
  }

 private:
  void read_texts() {
    require_format(file_, recording_format);
    if (const std::string unit = file_.text("length_unit"); unit != "mm") {
      file_.refuse("attribute 'length_unit' = '{}'; convert lengths to 'mm'", unit);
    }
    Recording& r = head_.recording;
    r.closed = file_.closed();
    r.path = path_.string();
    r.object = file_.text("object");
    r.pressure_unit = file_.text("pressure_unit");
    for (const auto& [name, text] :
         {std::pair{"rows", &r.rows}, {"sensor", &r.sensor}, {"serial", &r.serial}}) {
      if (file_.has_attribute(name)) {
        *text = file_.text(name);
      }
    }
    r.truth = read_truth(file_);
    r.findings = read_findings(file_);
  }

  void read_extents() {
    if (!file_.closed()) {
      rows_ = whole_rows(file_);
    }
    const Shape pressure = cut("pressure", file_.shape("pressure", 2));
    head_.rows = pressure[0];
    head_.elements = pressure[1];
    if (head_.rows == 0 || head_.elements == 0) {
      file_.refuse("dataset 'pressure' is empty, {}; record at least one touch by one element",
                   pressure);
    }
    const auto [n, e] = std::pair{head_.rows, head_.elements};
    if (head_.recording.rows != "frames" || file_.has_dataset("sensor_pose")) {
      require_shape("sensor_pose", {{n, 3}});
    }
    require_shape("elements", {{e, 2}, {n, e, 2}});
    head_.array_changes = file_.shape("elements").size() == 3;
    for (const char* name : {"time", "device_time", "lost_before"}) {
      has(name, {{n}});
    }
  }

  void read_small_lists() {
    Recording& r = head_.recording;
    const auto [n, e] = std::pair{head_.rows, head_.elements};
    if (has("valid", {{e}, {n, e}})) {
      r.valid.reserve(stored_bytes(file_.shape("valid"), 1));
      file_.read("valid", [&](std::uint64_t, std::span<const double> values) {
        for (const double valid : values) {
          if (std::isnan(valid)) {
            file_.refuse(
                "dataset 'valid' holds NaN; store 0 for a dead element and 1 for the others");
          }
          r.valid.push_back(valid != 0);
        }
      });
    }
    if (has("baseline", {{e}})) {
      file_.read("baseline", [&](std::uint64_t, std::span<const double> values) {
        r.baseline.insert(r.baseline.end(), values.begin(), values.end());
      });
      // A NaN in the baseline of a stream: the recording was cut off before the baseline was known.
      for (std::uint64_t k = 0; r.rows == "frames" && k < r.baseline.size(); ++k) {
        if ((r.valid.size() != e || r.valid[k] != 0) && std::isnan(r.baseline[k])) {
          r.baseline.clear();
        }
      }
    }
  }

  void read_rows() {
    const Recording& head = head_.recording;
    read_list("pressure", [&](std::uint64_t first, std::span<const double> values) {
      require_pressures(path_, head, head_.elements, first, values);
      takers_.pressure(values);
    });
    read_poses();
    read_tuples<glm::dvec2>("elements", head_.array_changes ? head_.rows : head_.elements,
                            [&](std::size_t first, std::span<const glm::dvec2> some) {
                              require_elements(path_, first, some);
                              takers_.elements_mm(some);
                            });
    read_list("time", [&](std::uint64_t first, std::span<const double> values) {
      require_times(path_, first, values);
      takers_.time_s(values);
    });
    read_list("device_time", [&](std::uint64_t first, std::span<const double> values) {
      require_device_times(path_, first, values);
      takers_.device_time_s(values);
    });
    read_list("lost_before", [&](std::uint64_t, std::span<const double> values) {
      takers_.lost_before(counts_of(values));
    });
  }

  void read_poses() {
    if (!file_.has_dataset("sensor_pose")) {
      // A stream without poses: every pose is unknown.
      const std::vector<Pose> unknown(std::min<std::uint64_t>(head_.rows, 4096), unknown_pose);
      for (std::uint64_t left = head_.rows; left > 0; left -= std::min(left, unknown.size())) {
        takers_.T_robot_sensor(std::span(unknown).first(std::min(left, unknown.size())));
      }
      return;
    }
    read_tuples<Pose>("sensor_pose", head_.rows,
                      [&](std::size_t first, std::span<const Pose> some) {
                        require_poses(path_, head_.recording, first, some);
                        takers_.T_robot_sensor(some);
                      });
  }

  void read_list(const char* name, const Hdf5Contents::Take& take) {
    if (file_.has_dataset(name)) {
      file_.read(name, take, head_.rows);
    }
  }

  /// Hands on tuples of numbers, with the index of the first.
  template <typename Tuple, typename Take>
  void read_tuples(const char* name, std::uint64_t rows, const Take& take) {
    std::vector<Tuple> tuples;
    const auto take_tuples = [&](std::uint64_t first, std::span<const double> numbers) {
      constexpr std::size_t width = sizeof(Tuple) / sizeof(double);
      tuples.resize(numbers.size() / width);
      std::memcpy(static_cast<void*>(tuples.data()), numbers.data(), numbers.size_bytes());
      take(first / width, std::span<const Tuple>(tuples));
    };
    file_.read(name, take_tuples, rows);
  }

  std::vector<std::uint64_t> counts_of(std::span<const double> values) const {
    std::vector<std::uint64_t> counts;
    counts.reserve(values.size());
    for (const double value : values) {
      if (!(value >= 0.0 && value <= static_cast<double>(largest_count) &&
            value == std::floor(value))) {
        file_.refuse("dataset 'lost_before' holds {}; store counts of frames up to {}", value,
                     largest_count);
      }
      counts.push_back(static_cast<std::uint64_t>(value));
    }
    return counts;
  }

  /// Returns the shape without incomplete rows.
  Shape cut(std::string_view name, Shape shape) const {
    const bool has_rows =
        std::ranges::find(row_names, name) != std::end(row_names) && !shape.empty();
    if (has_rows) {
      shape[0] = std::min(shape[0], rows_);
    }
    return shape;
  }

  void require_shape(const char* name, const std::vector<Shape>& fitting) const {
    const Shape shape = cut(name, file_.shape(name));
    if (std::find(fitting.begin(), fitting.end(), shape) == fitting.end()) {
      file_.refuse("dataset '{}' has the shape {}; 'pressure' is [{}, {}], so make it {}", name,
                   shape, head_.rows, head_.elements,
                   fmt::format("{}", fmt::join(fitting, " or ")));
    }
  }

  /// Whether the file has the dataset. Throws Error where its shape does not fit.
  bool has(const char* name, const std::vector<Shape>& fitting) const {
    if (file_.has_dataset(name)) {
      require_shape(name, fitting);
    }
    return file_.has_dataset(name);
  }

  const std::filesystem::path& path_;
  const RecordingTakers& takers_;
  Hdf5Contents file_;
  std::uint64_t rows_ = UINT64_MAX;  ///< complete rows of a file that is not closed
  RecordingHead head_;
};

}  // namespace

void scan_recording(const std::filesystem::path& path, const RecordingTakers& takers) {
  Scan(path, takers).run();
}

}  // namespace palpate
