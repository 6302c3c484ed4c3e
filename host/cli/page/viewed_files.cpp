#include "cli/page/viewed_files.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <set>

#include <glm/vec3.hpp>

#include "cli/page/page_json.hpp"
#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "io/recording_survey.hpp"
#include "palpate/files.hpp"
#include "recognition/judged_results.hpp"

namespace palpate::cli {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t rows_at_once = 64;
constexpr const char* kinds[] = {"recording", "map", "records"};

bool is_hdf5(const fs::path& path) {
  const std::string extension = path.extension();
  return extension == ".h5" || extension == ".hdf5";
}

/// The known poses whose x or y is the least or the largest.
nlohmann::ordered_json reach_of(std::span<const Pose> poses) {
  std::vector<glm::dvec3> known;
  for (const Pose& pose : poses) {
    if (is_finite(pose)) {
      known.emplace_back(pose.translation_mm, pose.theta_rad);
    }
  }
  auto json = nlohmann::ordered_json::array();
  for (const int axis : {0, 1}) {
    const auto [least, most] =
        std::ranges::minmax_element(known, {}, [axis](const glm::dvec3& p) { return p[axis]; });
    for (const auto end : {least, most}) {
      if (end != known.end()) {
        json.push_back({end->x, end->y, end->z});
      }
    }
  }
  return json;
}

/// What `live --json` wrote is of touches, one a line.
bool is_live(const Json& record) {
  const auto holds_number = [&](const char* key) {
    return record.contains(key) && record[key].is_number();
  };
  return holds_number("unknown") && holds_number("touch");
}

/// "" where the field is missing or null.
std::string text_in(const Json& record, const char* key) {
  return record.contains(key) && record[key].is_string() ? record[key].get<std::string>() : "";
}

}  // namespace

ViewedFiles::Rows ViewedFiles::rows_of(const fs::path& path) {
  Rows rows;
  ReadingHistogram readings;
  std::size_t known = 0;
  Recording& recording = rows.recording;
  const RecordingFile file(path);
  recording = file.head().recording;
  rows.elements = file.head().elements;
  rows.pressure.reserve(file.head().rows * rows.elements);
  const auto append = [](auto& list, const auto& more) {
    list.insert(list.end(), more.begin(), more.end());
  };
  Recording some;
  const std::uint64_t at_once = std::max<std::uint64_t>(1, (1 << 19) / rows.elements);
  for (std::uint64_t first = 0; first < file.head().rows; first += at_once) {
    file.read(first, std::min(at_once, file.head().rows - first), some);
    append(rows.pressure, some.pressure);
    append(recording.T_robot_sensor, some.T_robot_sensor);
    append(recording.time_s, some.time_s);
    if (recording.elements_mm.empty()) {  // a changing array is drawn as it begins
      append(recording.elements_mm, std::span(some.elements_mm).first(rows.elements));
    }
    for (const double value : some.pressure) {
      // One reading of 1e38 shall not be the scale.
      if (value > 0.0 && value < 1e30) {
        readings.add(value);
        ++known;
      }
    }
  }
  rows.largest = known == 0 ? 0.0 : readings.quantile(0.999);
  return rows;
}

nlohmann::ordered_json ViewedFiles::described(const Rows& rows) {
  const Recording& recording = rows.recording;
  const std::size_t e = rows.elements;
  nlohmann::ordered_json json{
      {"kind", kinds[0]},
      {"rows", recording.rows},
      {"count", recording.size()},
      {"object", recording.object},
      {"pressure_unit", recording.pressure_unit},
      {"elements_mm", places_json(recording.elements_mm)},
      {"reach", reach_of(recording.T_robot_sensor)},
      {"valid", recording.valid.size() >= e
                    ? std::vector(recording.valid.begin(), recording.valid.begin() + e)
                    : std::vector<std::uint8_t>()}};
  if (rows.largest > 0.0) {
    json["largest"] = rows.largest;
  }
  if (!recording.time_s.empty()) {
    json["begin_s"] = recording.time_s.front();
  }
  return json;
}

nlohmann::ordered_json ViewedFiles::some_of(const Rows& rows, std::size_t first) {
  const Recording& recording = rows.recording;
  const std::size_t last = std::min(recording.size(), first + rows_at_once);
  std::vector<double> row(rows.elements);
  auto pressure = nlohmann::ordered_json::array();
  auto pose = nlohmann::ordered_json::array();
  for (std::size_t i = first; i < last; ++i) {
    std::copy_n(&rows.pressure[i * row.size()], row.size(), row.begin());
    pressure.push_back(pressure_json(row));
    pose.push_back(pose_json(recording.T_robot_sensor[i]));  // NaN becomes null
  }
  nlohmann::ordered_json json{{"first", first}, {"pressure", pressure}, {"pose", pose}};
  if (!recording.time_s.empty()) {
    json["time"] = std::vector(recording.time_s.begin() + static_cast<std::ptrdiff_t>(first),
                               recording.time_s.begin() + static_cast<std::ptrdiff_t>(last));
  }
  return json;
}

void ViewedFiles::Records::add(const Json& record) {
  const std::string best = text_in(record, "best");
  const std::string error = text_in(record, "error");
  const bool counted = record.contains("touches") && record["touches"].is_number();
  nlohmann::ordered_json row{text_in(record, "recording"),
                             counted ? record["touches"].get<int>() : 0};
  if (record.contains("frame")) {
    row[0] = row[0].get<std::string>() + " frame " + record["frame"].dump();
  }
  const auto inner = [&record](const char* key, const char* of) -> nlohmann::ordered_json {
    return record.contains(key) && record[key].contains(of)
               ? nlohmann::ordered_json(record[key][of])
               : nullptr;
  };
  row.push_back(error.empty() ? best : error);
  row.push_back(inner("identity", best.c_str()));
  row.push_back(inner("truth", "object"));
  const char* error_mm = record.contains("refined_error_mm") ? "refined_error_mm" : "error_mm";
  row.push_back(record.contains(error_mm) ? nlohmann::ordered_json(record[error_mm]) : nullptr);
  row.push_back(inner("fit", "verdict"));
  row.push_back(inner("decision", "act"));
  rows.push_back(row);
  text.push_back(line_of(record));
}

ViewedFiles::Records ViewedFiles::records_of(const fs::path& results) {
  Records records;
  std::vector<Json> lines;  // of the unknown that live told of last
  const auto end_unknown = [&] {
    if (!lines.empty()) {
      Json record = lines.back();
      record["recording"] = "unknown " + std::to_string(record["unknown"].get<int>() + 1);
      record["touches"] = record["touch"].get<int>() + 1;
      record["trace"] = lines;
      records.add(record);
      lines.clear();
    }
  };
  for (const fs::path& file : result_files(std::vector<std::string>{results.string()})) {
    for (Json& record : records_in(file)) {
      if (!is_live(record)) {
        records.add(record);
        continue;
      }
      if (record.contains("next")) {
        if (!lines.empty()) {
          lines.back()["next"] = record["next"];
        }
        continue;
      }
      if (!lines.empty() && lines.back()["unknown"] != record["unknown"]) {
        end_unknown();
      }
      lines.push_back(std::move(record));
    }
    end_unknown();
  }
  return records;
}

ViewedFiles::ViewedFiles(std::span<const std::string> paths) {
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error) || fs::exists(fs::path(path) / "task.ndjson", error)) {
      add(path);
      continue;
    }
    std::set<fs::path> inside;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      if (is_hdf5(entry.path()) || entry.path().extension() == ".json" ||
          entry.path().extension() == ".jsonl") {
        inside.insert(entry.path());
      }
    }
    if (inside.empty()) {
      refuse(path, "a folder without *.h5 or *.json; give recordings, maps or results");
    }
    for (const fs::path& file : inside) {
      add(file);
    }
  }
}

void ViewedFiles::add(const fs::path& path) {
  if (!is_hdf5(path)) {
    files_.push_back({path, records_of(path)});
    return;
  }
  require_readable(path);
  const std::string format = read_format(path);
  if (format == "palpate.recording") {
    files_.push_back({path, rows_of(path)});
  } else if (format == "palpate.map") {
    files_.push_back({path, read_map(path)});
  } else {
    refuse(path,
           "attribute 'format' = '{}'; give recordings, maps or results of recognize, live or "
           "batch",
           format);
  }
}

std::string ViewedFiles::list() const {
  auto json = nlohmann::ordered_json::array();
  for (const File& file : files_) {
    json.push_back({{"name", file.path.string()}, {"kind", kinds[file.content.index()]}});
  }
  return line_of(json);
}

std::optional<nlohmann::ordered_json> ViewedFiles::answer(const File& file) const {
  if (const auto* map = std::get_if<OccupancyGrid>(&file.content)) {
    nlohmann::ordered_json json = map_json(*map);
    json["kind"] = kinds[1];
    return json;
  }
  if (const auto* records = std::get_if<Records>(&file.content)) {
    return nlohmann::ordered_json{{"kind", kinds[2]}, {"rows", records->rows}};
  }
  return described(std::get<Rows>(file.content));
}

std::optional<nlohmann::ordered_json> ViewedFiles::answer(const File& file, const std::string& what,
                                                          std::size_t index) const {
  if (const auto* rows = std::get_if<Rows>(&file.content)) {
    return what == "rows" && index < rows->recording.size() ? std::optional(some_of(*rows, index))
                                                            : std::nullopt;
  }
  const auto* records = std::get_if<Records>(&file.content);
  if (records == nullptr || index >= records->text.size()) {
    return {};
  }
  const Json record = Json::parse(records->text[index]);
  if (what == "record") {
    return record;
  }
  if (what != "map" || !record.contains("mode")) {
    return {};
  }
  // Relative to where recognize ran, which may be where this runs, or beside the results.
  const Json& mode = record["mode"];
  const fs::path named = text_in(mode, "map");
  const bool mirrored = mode.contains("mirrored") && mode["mirrored"] == true;
  for (const fs::path& path : {named, file.path.parent_path() / named}) {
    try {
      OccupancyGrid map = read_map(path);
      return map_json(mirrored ? mirror_image(map) : map);
    } catch (const Error&) {
      // A map that is elsewhere now is not shown.
    }
  }
  return {};
}

std::optional<std::string> ViewedFiles::get(const std::string& path) const {
  std::vector<std::string> parts;
  for (std::size_t at = 0; at < path.size();) {
    const std::size_t next = std::min(path.find('/', at + 1), path.size());
    parts.push_back(path.substr(at + 1, next - at - 1));
    at = next;
  }
  const auto number = [&parts](std::size_t i) {
    const bool whole = !parts[i].empty() && parts[i].size() < 10 &&
                       parts[i].find_first_not_of("0123456789") == std::string::npos;
    return whole ? std::strtoul(parts[i].c_str(), nullptr, 10)
                 : std::numeric_limits<unsigned long>::max();
  };
  if ((parts.size() != 2 && parts.size() != 4) || parts[0] != "file" ||
      number(1) >= files_.size()) {
    return {};
  }
  const File& file = files_[number(1)];
  const auto json = parts.size() == 2 ? answer(file) : answer(file, parts[2], number(3));
  return json ? std::optional(line_of(*json)) : std::nullopt;
}

}  // namespace palpate::cli
