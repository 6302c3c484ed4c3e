#include "recognition/request.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "options/option.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

/// Sets the axis to the range, if there is one.
void set_range(const std::optional<Range>& range, double unit, Axis& axis) {
  if (range) {
    axis.lower = (*range)[0] * unit;
    axis.upper = (*range)[1] * unit;
  }
}

/// The sensor model in the folder of a map's file; none where there is no such file.
std::optional<std::filesystem::path> sensor_beside(const std::filesystem::path& map) {
  std::error_code ignored;
  std::filesystem::path file = map.parent_path() / folder_sensor_name;
  return std::filesystem::exists(file, ignored) ? std::optional(std::move(file)) : std::nullopt;
}

template <typename Values>
void append(std::string& bytes, const Values& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
}

/// The one sensor model in the folders of the maps' files.
SensorFromFile sensor_beside_all(std::span<const Hypothesis> hypotheses,
                                 std::vector<std::string>& remarks) {
  std::set<std::filesystem::path> files;
  SensorFromFile known;
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::string& map = hypothesis.map.file;
    const auto beside = map.empty() ? std::nullopt : sensor_beside(map);
    if (!beside || !files.insert(*beside).second) {
      continue;
    }
    SensorFromFile sensor = sensor_from(*beside);
    if (sensor.maps.empty()) {
      remarks.push_back(
          fmt::format("{} does not say which maps it is for, and is left out; give "
                      "`sensor-model {}` to take it",
                      sensor.file, sensor.file));
    } else if (known.file.empty()) {
      known = std::move(sensor);
    } else if (hash_of_file(*beside) != hash_of_file(known.file)) {
      refuse(*beside,
             "differs from {}: each is for the maps of its own folder; give `sensor-model` with "
             "one of them, or `sensor-model none`",
             known.file);
    }
  }
  return known;
}

}  // namespace

Request complete(Request request) {
  if (request.scene.empty()) {
    return request;
  }
  Scene scene = read_scene(request.scene);
  for (const auto& [name, text] : scene.options) {
    const Option& option = option_named(name);
    if (option_text(request, option).empty()) {
      set_option(request, option, text);
      request.keys[name] = option.scene_key;
    }
  }
  request.objects = std::move(scene.objects);
  request.array_mm = std::move(scene.array_mm);
  request.array_file = std::move(scene.array_file);
  return request;
}

std::vector<Scene::Object> objects_of(const Request& request) {
  std::vector<Scene::Object> objects;
  const auto add = [&](const std::filesystem::path& map) {
    objects.push_back({.map = map, .label = {}, .symmetry = {}, .mirror = {}});
  };
  for (const GivenMap& given : request.given_maps) {
    add(given.name);
  }
  if (!objects.empty()) {
    return objects;
  }
  for (const std::string& argument : request.maps) {
    for (const std::filesystem::path& file : map_files(argument)) {
      add(file);
    }
  }
  if (!objects.empty() || !request.objects.empty()) {
    return objects.empty() ? request.objects : objects;
  }
  if (request.scene.empty()) {
    refuse_option("maps", "missing; give the objects' maps, or a `scene` with objects");
  }
  refuse(request.scene, "objects: missing; list the maps there or give `maps`");
}

std::vector<std::pair<std::string, std::filesystem::path>> files_of(const Request& request) {
  std::vector<std::pair<std::string, std::filesystem::path>> files;
  if (!request.scene.empty()) {
    files.emplace_back("scene", request.scene);
  }
  if (request.array_file) {
    files.emplace_back("scene", *request.array_file);
  }
  if (!request.sensor_model.empty() && request.sensor_model != no_sensor_model) {
    files.emplace_back(request.keys.contains("sensor-model") ? "scene" : "sensor-model",
                       request.sensor_model);
  }
  const char* of_maps = request.maps.empty() ? "scene" : "maps";
  std::set<std::filesystem::path> beside;
  for (const Scene::Object& object : objects_of(request)) {
    files.emplace_back(of_maps, object.map);
    if (const auto sensor = sensor_beside(object.map); sensor && request.sensor_model.empty()) {
      beside.insert(*sensor);
    }
  }
  for (const std::filesystem::path& sensor : beside) {
    files.emplace_back(of_maps, sensor);
  }
  return files;
}

std::vector<std::filesystem::path> maps_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files = paths_in(folder);
  // A look into each file would take as long as reading it.
  std::erase_if(files, [](const std::filesystem::path& file) {
    return !file.filename().string().ends_with(".map.h5") &&
           (file.extension() != ".h5" || read_format(file) != "palpate.map");
  });
  return files;
}

std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument) {
  std::error_code error;
  if (!std::filesystem::is_directory(argument, error)) {
    return {argument};
  }
  std::vector<std::filesystem::path> files = maps_in(argument);
  if (files.empty()) {
    refuse(argument, "a folder without maps; build some with palpate map");
  }
  return files;
}

std::string digest_of(const OccupancyGrid& map) {
  std::string bytes;
  append(bytes, std::array{map.cell_mm, map.origin_mm.x, map.origin_mm.y, map.prior});
  append(bytes, std::array{map.nx, map.ny});
  append(bytes, map.log_odds);
  append(bytes, map.observations);
  append(bytes, map.mean_level);
  return hash_of(bytes);
}

SensorFromFile sensor_from(const std::filesystem::path& file) {
  return {read_sensor_model(file), file.string()};
}

SensorFromFile folder_sensor(std::span<const Hypothesis> hypotheses,
                             std::vector<std::string>& remarks) {
  SensorFromFile known = sensor_beside_all(hypotheses, remarks);
  if (known.file.empty()) {
    return known;
  }
  const auto stranger = std::ranges::find_if_not(hypotheses, [&](const Hypothesis& hypothesis) {
    return std::ranges::any_of(known.maps, [digest = digest_of(hypothesis.map)](const auto& map) {
      return map.second == digest;
    });
  });
  if (stranger == hypotheses.end()) {
    return known;
  }
  const OccupancyGrid& map = stranger->map;
  const bool of_folder = std::filesystem::path(map.file).parent_path() ==
                         std::filesystem::path(known.file).parent_path();
  remarks.push_back(fmt::format(
      "{} was not learned for {}, and is left out; build {} with palpate map, or give "
      "`sensor-model`",
      known.file, map.file.empty() ? fmt::format("the map of '{}' in memory", map.label) : map.file,
      of_folder ? "the folder's maps anew" : "the maps of both anew in one folder"));
  return {};
}

bool infers_region(const Request& request) {
  return !request.x_mm && !request.y_mm && !request.theta_deg &&
         !(request.pivot_mm && !has_auto_pivot(request)) &&
         !(request.bins && std::holds_alternative<std::array<int, 3>>(*request.bins));
}

bool has_auto_pivot(const Request& request) {
  return request.pivot_mm && std::holds_alternative<Automatic>(*request.pivot_mm);
}

PoseLattice given_lattice(const Request& request) {
  PoseLattice lattice;
  set_range(request.x_mm, 1.0, lattice.x_mm);
  set_range(request.y_mm, 1.0, lattice.y_mm);
  set_range(request.theta_deg, std::numbers::pi / 180.0, lattice.theta_rad);
  if (lattice.exceeds_circle()) {
    refuse_given(request, "theta-deg",
                 "wider than the full circle, poses would count twice; give a range of at most 360 "
                 "degrees");
  }
  if (const auto* counts =
          request.bins ? std::get_if<std::array<int, 3>>(&*request.bins) : nullptr) {
    const auto [x, y, theta] = *counts;
    lattice.x_mm.count = x;
    lattice.y_mm.count = y;
    lattice.theta_rad.count = theta;
  }
  if (request.pivot_mm && !has_auto_pivot(request)) {
    lattice.pivot_mm = std::get<glm::dvec2>(*request.pivot_mm);
  }
  return lattice.collapse_fixed();
}

void replace_array(const Request& request, const std::string& source, std::size_t elements,
                   std::vector<glm::dvec2>& elements_mm) {
  if (!request.array_mm) {
    return;
  }
  if (elements != request.array_mm->size()) {
    refuse(
        source,
        "pressure: {} elements, but array of {} has {}; use its own array by leaving the key out",
        elements, request.scene, request.array_mm->size());
  }
  elements_mm = *request.array_mm;
}

void replace_array(const Request& request, Recording& recording) {
  replace_array(request, recording.path, recording.elements(), recording.elements_mm);
}

}  // namespace palpate
