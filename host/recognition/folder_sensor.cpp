#include "recognition/folder_sensor.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "io/file_hash.hpp"
#include "io/input_file.hpp"

namespace palpate {

namespace {

template <typename Values>
void append(std::string& bytes, const Values& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
}

/// A map's name in messages.
std::string name_of(const OccupancyGrid& map) {
  return map.file.empty() ? fmt::format("the map of '{}' in memory", map.label) : map.file;
}

}  // namespace

std::string digest_of(const OccupancyGrid& map) {
  std::string bytes;
  append(bytes, std::array{map.cell_mm, map.origin_mm.x, map.origin_mm.y, map.prior});
  append(bytes, std::array{map.nx, map.ny});
  append(bytes, map.log_odds);
  append(bytes, map.observations);
  append(bytes, map.mean_level);
  return hash_of(bytes);
}

std::optional<std::filesystem::path> sensor_beside(const std::filesystem::path& map) {
  std::error_code ignored;
  std::filesystem::path file = map.parent_path() / folder_sensor_name;
  return std::filesystem::exists(file, ignored) ? std::optional(std::move(file)) : std::nullopt;
}

std::optional<SensorFromFile> folder_sensor(std::span<const Hypothesis> hypotheses,
                                            std::vector<std::string>& remarks) {
  std::optional<SensorFromFile> known;
  std::set<std::filesystem::path> seen;
  for (const Hypothesis& hypothesis : hypotheses) {
    const auto beside =
        hypothesis.map.file.empty() ? std::nullopt : sensor_beside(hypothesis.map.file);
    if (!beside || !seen.insert(*beside).second) {
      continue;
    }
    LearnedSensor sensor = read_sensor_model(*beside);
    if (sensor.maps.empty()) {
      remarks.push_back(
          fmt::format("{} does not say which maps it is for, and is left out; give "
                      "`sensor-model {}` to take it",
                      beside->string(), beside->string()));
    } else if (!known) {
      known = {beside->string(), std::move(sensor)};
    } else if (hash_of_file(*beside) != hash_of_file(known->file)) {
      refuse(*beside,
             "differs from {}: each is for the maps of its own folder; give `sensor-model` with "
             "one of them, or `sensor-model none`",
             known->file);
    }
  }
  if (!known) {
    return {};
  }
  const SensorFromFile& found = *known;
  const auto knows = [&](const Hypothesis& hypothesis) {
    return std::ranges::any_of(
        found.sensor.maps,
        [digest = digest_of(hypothesis.map)](const auto& map) { return map.second == digest; });
  };
  const auto stranger = std::ranges::find_if_not(hypotheses, knows);
  if (stranger == hypotheses.end()) {
    return known;
  }
  const std::filesystem::path folder = std::filesystem::path(found.file).parent_path();
  const bool of_folder = std::filesystem::path(stranger->map.file).parent_path() == folder;
  remarks.push_back(
      fmt::format("{} was not learned for {}, and is left out; build {} with palpate map, or give "
                  "`sensor-model`",
                  found.file, name_of(stranger->map),
                  of_folder ? "the folder's maps anew" : "the maps of both anew in one folder"));
  return {};
}

}  // namespace palpate
