#include "cli/page/viewed_files.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/page/page_json.hpp"
#include "io/input_file.hpp"
#include "io/recording_file.hpp"
#include "io/recording_rules.hpp"
#include "io/recording_survey.hpp"
#include "model/number_text.hpp"
#include "palpate/files.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A file with what a page shows of it.
struct ViewedFile {
  fs::path path;
  const char* kind;
  std::string overview;  ///< JSON
  /// A part by its name and number; null where there is none.
  std::function<Json(const std::string& name, std::size_t index)> part;
};

namespace {

constexpr std::size_t rows_at_once = 64;

/// The known poses whose x or y is the least or the largest.
Json reach_of(std::vector<Pose> poses) {
  std::erase_if(poses, [](const Pose& pose) { return !is_finite(pose); });
  auto json = Json::array();
  for (const int axis : {0, 1}) {
    const auto [least, most] = std::ranges::minmax_element(
        poses, {}, [axis](const Pose& pose) { return pose.translation_mm[axis]; });
    for (const auto end : {least, most}) {
      if (end != poses.end()) {
        json.push_back(pose_json(*end));
      }
    }
  }
  return json;
}

/// Some rows; null beyond the last.
/// @param pressure [n, e]
Json rows_json(const Recording& recording, std::span<const float> pressure, std::size_t first) {
  if (first >= recording.size()) {
    return nullptr;
  }
  const std::size_t elements = pressure.size() / recording.size();
  Json json{{"first", first}, {"pressure", Json::array()}, {"pose", Json::array()}};
  const std::size_t last = std::min(recording.size(), first + rows_at_once);
  for (std::size_t i = first; i < last; ++i) {
    const std::span row = pressure.subspan(i * elements, elements);
    json["pressure"].push_back(pressure_json(std::vector<double>(row.begin(), row.end())));
    json["pose"].push_back(pose_json(recording.T_robot_sensor[i]));  // NaN becomes null
    if (!recording.time_s.empty()) {
      json["time"].push_back(recording.time_s[i]);
    }
  }
  return json;
}

ViewedFile view_recording(const fs::path& path) {
  const RecordingFile file(path);
  const std::size_t elements = file.head().elements;
  Recording recording = file.head().recording;  // whose pressures stay out of it
  std::vector<float> pressure;                  // four digits are shown, which float holds
  pressure.reserve(file.head().rows * elements);
  const auto append = [](auto& list, const auto& more) {
    list.insert(list.end(), more.begin(), more.end());
  };
  bool shows_pressure = false;
  ReadingHistogram readings;
  Recording some;
  const std::uint64_t at_once = std::max<std::uint64_t>(1, (1 << 19) / elements);
  for (std::uint64_t first = 0; first < file.head().rows; first += at_once) {
    file.read(first, std::min(at_once, file.head().rows - first), some);
    append(pressure, some.pressure);
    append(recording.T_robot_sensor, some.T_robot_sensor);
    append(recording.time_s, some.time_s);
    if (recording.elements_mm.empty()) {  // a changing array is drawn as it begins
      append(recording.elements_mm, std::span(some.elements_mm).first(elements));
    }
    for (const double value : some.pressure) {
      if (value > 0.0 && value < 1e30) {  // one reading of 1e38 shall not be the scale
        readings.add(value);
        shows_pressure = true;
      }
    }
  }
  const std::vector<std::uint8_t>& valid = recording.valid;
  Json overview{{"kind", "recording"},
                {"rows", recording.rows},
                {"count", recording.size()},
                {"object", recording.object},
                {"pressure_unit", recording.pressure_unit},
                {"elements_mm", places_json(recording.elements_mm)},
                {"reach", reach_of(recording.T_robot_sensor)},
                {"valid", std::span(valid).first(valid.size() >= elements ? elements : 0)}};
  if (shows_pressure) {
    overview["largest"] = readings.quantile(0.999);
  }
  if (!recording.time_s.empty()) {
    overview["begin_s"] = recording.time_s.front();
  }
  return {path, "recording", text_of(overview),
          [recording = std::move(recording), pressure = std::move(pressure)](
              const std::string& name, std::size_t first) {
            return name == "rows" ? rows_json(recording, pressure, first) : nullptr;
          }};
}

ViewedFile view_map(const fs::path& path) {
  Json overview{{"kind", "map"}};
  overview.update(map_json(read_map(path)));
  return {path, "map", text_of(overview), [](const auto&...) { return Json(); }};
}

/// What stands behind a pointer such as "/mode/map"; null where there is nothing.
Json value_at(const nlohmann::json& record, const std::string& pointer) {
  const nlohmann::json::json_pointer at(pointer);
  return record.contains(at) ? Json(record.at(at)) : Json();
}

std::string text_at(const nlohmann::json& record, const std::string& pointer) {
  const Json value = value_at(record, pointer);
  return value.is_string() ? value.get<std::string>() : "";
}

/// What `live --json` wrote is of touches, one a line.
bool is_live(const nlohmann::json& record) {
  return value_at(record, "/unknown").is_number() && value_at(record, "/touch").is_number();
}

/// Results as they are read.
struct ViewedRecords {
  std::vector<std::string> records;  ///< JSON of each
  Json rows = Json::array();

  void add(const nlohmann::json& record) {
    const std::string best = text_at(record, "/best");
    const std::string error = text_at(record, "/error");
    const Json touches = value_at(record, "/touches");
    const std::string frame =
        record.contains("frame") ? " frame " + record["frame"].dump() : std::string();
    const Json identity = value_at(record, "/identity");
    rows.push_back(Json::array(
        {text_at(record, "/recording") + frame, touches.is_null() ? Json(0) : touches,
         error.empty() ? best : error, identity.contains(best) ? identity[best] : Json(),
         value_at(record, "/truth/object"),
         value_at(record, record.contains("refined_error_mm") ? "/refined_error_mm" : "/error_mm"),
         value_at(record, "/fit/verdict"), value_at(record, "/decision/act")}));
    records.push_back(text_of(record));
  }

  /// Adds an unknown of `live`: its last line, with all of them as its trace.
  void add_unknown(const std::vector<nlohmann::json>& lines) {
    if (!lines.empty()) {
      nlohmann::json record = lines.back();
      record["recording"] = "unknown " + std::to_string(record["unknown"].get<int>() + 1);
      record["touches"] = record["touch"].get<int>() + 1;
      record["trace"] = lines;
      add(record);
    }
  }
};

/// @param results the file or folder that the record stands in
Json map_of(const nlohmann::json& record, const fs::path& results) {
  // Relative to where recognize ran, which may be where this runs, or beside the results.
  const fs::path named = text_at(record, "/mode/map");
  for (const fs::path& file : {named, results.parent_path() / named}) {
    try {
      const OccupancyGrid map = read_map(file);
      return map_json(value_at(record, "/mode/mirrored") == true ? mirror_image(map) : map);
    } catch (const Error&) {
      // A map that is elsewhere now is not shown.
    }
  }
  return nullptr;
}

ViewedFile view_records(const fs::path& path) {
  ViewedRecords viewed;
  for (const fs::path& file : result_files(std::vector<std::string>{path.string()})) {
    std::vector<nlohmann::json> lines;  // of the unknown that live told of last
    for (nlohmann::json& record : records_in(file)) {
      if (!is_live(record)) {
        viewed.add(record);
      } else if (!record.contains("next")) {
        if (!lines.empty() && lines.back()["unknown"] != record["unknown"]) {
          viewed.add_unknown(std::exchange(lines, {}));
        }
        lines.push_back(std::move(record));
      } else if (!lines.empty()) {
        lines.back()["next"] = record["next"];
      }
    }
    viewed.add_unknown(lines);
  }
  return {path, "records", text_of(Json{{"kind", "records"}, {"rows", viewed.rows}}),
          [path, records = std::move(viewed.records)](const std::string& name,
                                                      std::size_t index) -> Json {
            if (index >= records.size()) {
              return nullptr;
            }
            const auto record = nlohmann::json::parse(records[index]);
            return name == "record" ? Json(record) : name == "map" ? map_of(record, path) : nullptr;
          }};
}

bool is_hdf5(const fs::path& path) {
  return path.extension() == ".h5" || path.extension() == ".hdf5";
}

ViewedFile view_file(const fs::path& path) {
  if (!is_hdf5(path)) {
    return view_records(path);
  }
  require_readable(path);
  const std::string format = read_format(path);
  if (format == "palpate.recording") {
    return view_recording(path);
  }
  if (format == "palpate.map") {
    return view_map(path);
  }
  refuse(path,
         "attribute 'format' = '{}'; give recordings, maps or results of recognize, live or batch",
         format);
}

}  // namespace

ViewedFiles::ViewedFiles(std::span<const std::string> paths) {
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error) || fs::exists(fs::path(path) / "task.ndjson", error)) {
      files_.push_back(view_file(path));
      continue;
    }
    std::vector<fs::path> inside = paths_in(path);
    std::erase_if(inside, [](const fs::path& file) {
      return !is_hdf5(file) && file.extension() != ".json" && file.extension() != ".jsonl";
    });
    if (inside.empty()) {
      refuse(path, "a folder without *.h5 or *.json; give recordings, maps or results");
    }
    std::ranges::transform(inside, std::back_inserter(files_), view_file);
  }
}

ViewedFiles::~ViewedFiles() = default;

std::string ViewedFiles::list() const {
  auto json = Json::array();
  for (const ViewedFile& file : files_) {
    json.push_back({{"name", file.path.string()}, {"kind", file.kind}});
  }
  return text_of(json);
}

std::optional<std::string> ViewedFiles::get(const std::string& path) const {
  const std::vector<std::string_view> asked = split_text(path, '/');
  if ((asked.size() != 3 && asked.size() != 5) || asked[1] != "file") {
    return {};
  }
  const auto number_at = [&](std::size_t i) {  // of what is no number: beyond all
    return static_cast<std::size_t>(whole_number_of(asked[i]).value_or(-1));
  };
  if (number_at(2) >= files_.size()) {
    return {};
  }
  const ViewedFile& file = files_[number_at(2)];
  if (asked.size() == 3) {
    return file.overview;
  }
  const Json part = file.part(std::string(asked[3]), number_at(4));
  return part.is_null() ? std::nullopt : std::optional(text_of(part));
}

}  // namespace palpate::cli
