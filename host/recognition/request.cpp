#include "recognition/request.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "recognition/folder_sensor.hpp"
#include "recognition/recordings.hpp"
#include "recognition/refused_option.hpp"

namespace palpate {

namespace {

constexpr double rad_per_deg = std::numbers::pi / 180.0;

using FilterName = std::pair<FilterKind, const char*>;
constexpr std::array<FilterName, 4> filter_names{{{FilterKind::automatic, "auto"},
                                                  {FilterKind::histogram, "histogram"},
                                                  {FilterKind::bounded, "bounded"},
                                                  {FilterKind::particles, "particles"}}};

/// Sets the axis to the range, if there is one.
void set_range(const char* option, const std::optional<std::array<double, 2>>& range, double unit,
               Axis& axis) {
  if (!range) {
    return;
  }
  const auto [lower, upper] = *range;
  const std::string given = fmt::format("{}:{}", lower, upper);
  if (lower > upper) {
    refuse_option(option, given, "the range is reversed; write the lower end first");
  }
  axis.lower = lower * unit;
  axis.upper = upper * unit;
  if (!(axis.lower >= -farthest_mm && axis.upper <= farthest_mm)) {
    refuse_option(option, given, "give numbers within +-{:g}", farthest_mm / unit);
  }
}

}  // namespace

std::string name_of(FilterKind kind) {
  return std::ranges::find(filter_names, kind, &FilterName::first)->second;
}

FilterKind filter_named(const std::string& name) {
  const auto* const found = std::ranges::find(filter_names, name, &FilterName::second);
  if (found == filter_names.end()) {
    refuse_option("filter", name, "not known; use auto, histogram, bounded or particles");
  }
  return found->first;
}

Resampling resampling_named(const std::string& name) {
  if (name != "multinomial" && name != "systematic") {
    refuse_option("resampling", name, "not known; use multinomial or systematic");
  }
  return name == "systematic" ? Resampling::systematic : Resampling::multinomial;
}

Request complete(Request request) {
  if (request.scene.empty()) {
    return request;
  }
  Scene scene = read_scene(request.scene);
  const auto take = [&](const char* option, auto& asked, const auto& given, const char* key) {
    if (!asked && given) {
      asked = *given;
      request.keys[option] = key;
    }
  };
  take("x-mm", request.x_mm, scene.region.x_mm, "x_mm");
  take("y-mm", request.y_mm, scene.region.y_mm, "y_mm");
  take("theta-deg", request.theta_deg, scene.region.theta_deg, "theta_deg");
  take("prior", request.prior, scene.prior, "prior");
  take("gamma", request.gamma, scene.gamma, "gamma");
  take("threshold", request.threshold, scene.threshold, "threshold");
  take("ratio", request.ratio, scene.ratio, "ratio");
  take("touch-sd-mm", request.touch_sd_mm, scene.touch_sd.mm, "touch_sd mm");
  take("touch-sd-deg", request.touch_sd_deg, scene.touch_sd.deg, "touch_sd deg");
  take("slip-sd-mm", request.slip_sd_mm, scene.slip_sd.mm, "slip_sd mm");
  take("slip-sd-deg", request.slip_sd_deg, scene.slip_sd.deg, "slip_sd deg");
  take("act-below-mm", request.act_below_mm, scene.act_below_mm, "act_below_mm");
  take("act-above", request.act_above, scene.act_above, "act_above");
  const auto automatic = [](bool given) {
    return given ? std::optional(Automatic{}) : std::nullopt;
  };
  take("pivot-mm", request.pivot_mm, automatic(scene.region.auto_pivot), "pivot_mm");
  take("pivot-mm", request.pivot_mm, scene.region.pivot_mm, "pivot_mm");
  take("none", request.none, automatic(scene.auto_none), "none");
  take("none", request.none, scene.none, "none");
  take("bins", request.bins,
       scene.fine_bins   ? std::optional(BinWidth::fine)
       : scene.auto_bins ? std::optional(BinWidth::automatic)
                         : std::nullopt,
       "bins");
  take("bins", request.bins, scene.bins, "bins");
  if (!request.filter && scene.filter) {
    request.filter = filter_named(*scene.filter);
    request.keys["filter"] = "filter: " + *scene.filter;
  }
  if (request.sensor_model.empty() && scene.sensor_model) {
    request.sensor_model = scene.sensor_model->string();
    request.keys["sensor-model"] = "sensor_model";
  }
  if (request.device.empty()) {
    request.device = scene.device.value_or("");
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
  set_range("x-mm", request.x_mm, 1.0, lattice.x_mm);
  set_range("y-mm", request.y_mm, 1.0, lattice.y_mm);
  set_range("theta-deg", request.theta_deg, rad_per_deg, lattice.theta_rad);
  if (lattice.exceeds_circle()) {
    refuse_option(
        "theta-deg", fmt::format("{}:{}", (*request.theta_deg)[0], (*request.theta_deg)[1]),
        "wider than the full circle, poses would count twice; give a range of at most 360 "
        "degrees");
  }
  if (const auto* counts =
          request.bins ? std::get_if<std::array<int, 3>>(&*request.bins) : nullptr) {
    const auto [x, y, theta] = *counts;
    if (std::min({x, y, theta}) < 1) {
      refuse_option("bins", fmt::format("{}x{}x{}", x, y, theta), "every count must be at least 1");
    }
    lattice.x_mm.count = x;
    lattice.y_mm.count = y;
    lattice.theta_rad.count = theta;
  }
  if (request.pivot_mm && !has_auto_pivot(request)) {
    lattice.pivot_mm = std::get<glm::dvec2>(*request.pivot_mm);
    if (!(std::abs(lattice.pivot_mm.x) <= farthest_mm &&
          std::abs(lattice.pivot_mm.y) <= farthest_mm)) {
      refuse_option("pivot-mm", fmt::format("{},{}", lattice.pivot_mm.x, lattice.pivot_mm.y),
                    "give numbers within +-{:g}", farthest_mm);
    }
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

}  // namespace palpate
