#include "palpate/scene.hpp"

#include <algorithm>
#include <fstream>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "io/pressure_table.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"
#include "yaml/yaml_entry.hpp"

namespace palpate {

namespace {

using Entry = YamlEntry;

std::array<double, 2> read_pair(const Entry& entry, const char* remedy) {
  const std::vector<Entry> entries = entry.list(2, remedy);
  return {entries[0].number(), entries[1].number()};
}

std::array<double, 2> read_range(const Entry& entry) {
  const std::array<double, 2> ends = read_pair(entry, "give [lower, upper]");
  if (ends[0] > ends[1]) {
    entry.refuse(fmt::format("[{}, {}] is reversed; write the lower end first", ends[0], ends[1]));
  }
  return ends;
}

std::array<double, 2> read_angles_deg(const Entry& entry) {
  const std::array<double, 2> ends = read_range(entry);
  constexpr double degree = std::numbers::pi / 180.0;
  if (PoseLattice{.theta_rad = {ends[0] * degree, ends[1] * degree, 1}}.exceeds_circle()) {
    entry.refuse(
        fmt::format("[{}, {}] is wider than the full circle, poses would count twice; give a range "
                    "of at most 360 degrees",
                    ends[0], ends[1]));
  }
  return ends;
}

glm::dvec2 read_point(const Entry& entry) {
  const std::array<double, 2> xy = read_pair(entry, "give [x, y]");
  return {xy[0], xy[1]};
}

void read_array(const Entry& array, Scene& scene) {
  if (array.node.IsScalar()) {
    const std::string name = array.text();
    if (name == "digitacts") {
      scene.array_mm = digitacts_array();
    } else {
      scene.array_file = array.file.parent_path() / name;
      scene.array_mm = palpate::read_array(*scene.array_file).elements_mm;
    }
    return;
  }
  std::vector<glm::dvec2> elements;
  for (const Entry& element : array.list("give 'digitacts', a file or a list of [x, y] in mm")) {
    elements.push_back(read_point(element));
  }
  if (elements.empty()) {
    array.refuse("give at least one [x, y] in mm");
  }
  scene.array_mm = std::move(elements);
}

Scene::Object read_object(const Entry& entry) {
  Scene::Object object;
  read_keys(entry, {{"map", [&](const Entry& e) { object.map = e.file.parent_path() / e.text(); }},
                    {"label", [&](const Entry& e) { object.label = e.text(); }},
                    {"symmetry", [&](const Entry& e) { object.symmetry = e.integer(0); }},
                    {"mirror",
                     [&](const Entry& e) {
                       object.mirror = e.one_of<bool>({{"true", true}, {"false", false}});
                     }},
                    {"weight", [&](const Entry& e) {
                       object.weight =
                           e.number([](double w) { return w > 0; }, "give a number above 0");
                     }}});
  if (object.map.empty()) {
    entry.refuse("key 'map' is missing; name the object's map file");
  }
  return object;
}

std::vector<Scene::Object> read_objects(const Entry& entry) {
  std::vector<Scene::Object> objects;
  for (const Entry& object : entry.list("give a list of {map: FILE}")) {
    objects.push_back(read_object(object));
  }
  return objects;
}

void read_pivot(const Entry& entry, Scene::Region& region) {
  if (entry.node.IsScalar() && entry.node.Scalar() == "auto") {
    region.auto_pivot = true;
    return;
  }
  const std::array<double, 2> xy = read_pair(entry, "give [x, y], or auto");
  region.pivot_mm = {xy[0], xy[1]};
}

Scene::Region read_region(const Entry& entry) {
  Scene::Region region;
  read_keys(entry, {{"x_mm", [&](const Entry& e) { region.x_mm = read_range(e); }},
                    {"y_mm", [&](const Entry& e) { region.y_mm = read_range(e); }},
                    {"theta_deg", [&](const Entry& e) { region.theta_deg = read_angles_deg(e); }},
                    {"pivot_mm", [&](const Entry& e) { read_pivot(e, region); }}});
  return region;
}

Scene::Displacement read_displacement(const Entry& entry) {
  const auto at_least_0 = [](double value) { return value >= 0; };
  constexpr const char* remedy = "give a number from 0";
  Scene::Displacement sd;
  read_keys(entry, {{"mm", [&](const Entry& e) { sd.mm = e.number(at_least_0, remedy); }},
                    {"deg", [&](const Entry& e) { sd.deg = e.number(at_least_0, remedy); }}});
  return sd;
}

void read_none(const Entry& entry, Scene& scene) {
  scene.auto_none = entry.node.IsScalar() && entry.node.Scalar() == "auto";
  if (!scene.auto_none) {
    scene.none =
        entry.number([](double weight) { return weight >= 0; }, "give a number from 0, or auto");
  }
}

void read_bins(const Entry& entry, Scene& scene) {
  scene.auto_bins = entry.node.IsScalar() && entry.node.Scalar() == "auto";
  scene.fine_bins = entry.node.IsScalar() && entry.node.Scalar() == "fine";
  if (scene.auto_bins || scene.fine_bins) {
    return;
  }
  const std::vector<Entry> counts =
      entry.list(3, "give the counts of bins [x, y, theta], or auto, or fine");
  scene.bins = {counts[0].integer(1), counts[1].integer(1), counts[2].integer(1)};
}

/// A file, relative to the scene's, or "none".
std::filesystem::path sensor_model_in(const Entry& entry) {
  const std::string name = entry.text();
  return name == "none" ? std::filesystem::path(name) : entry.file.parent_path() / name;
}

}  // namespace

Scene read_scene(const std::filesystem::path& path) {
  require_readable(path);
  Scene scene;
  read_document(std::ifstream(path), path, "the scene", [&](const Entry& root) {
    if (root.node.IsNull()) {
      return;  // comments alone: everything is left out
    }
    const auto number = [](std::optional<double>& key, bool (*fits)(double), const char* remedy) {
      return [&key, fits, remedy](const Entry& e) { key = e.number(fits, remedy); };
    };
    const auto at_least_0 = [](double value) { return value >= 0; };
    const auto rate = [](double value) { return value >= 0 && value < 1; };
    const auto inner = [](double value) { return value > 0 && value < 1; };
    const auto above_0 = [](double value) { return value > 0; };
    const auto probability = [](double value) { return value >= 0 && value <= 1; };
    read_keys(root,
              {{"array", [&](const Entry& e) { read_array(e, scene); }},
               {"sensor_model", [&](const Entry& e) { scene.sensor_model = sensor_model_in(e); }},
               {"threshold", number(scene.threshold, at_least_0, "give a number from 0")},
               {"ratio", number(scene.ratio, rate, "give a number in [0, 1)")},
               {"gamma", number(scene.gamma, rate, "give a number in [0, 1)")},
               {"prior", number(scene.prior, inner, "give a number in (0, 1)")},
               {"objects", [&](const Entry& e) { scene.objects = read_objects(e); }},
               {"region", [&](const Entry& e) { scene.region = read_region(e); }},
               {"none", [&](const Entry& e) { read_none(e, scene); }},
               {"touch_sd", [&](const Entry& e) { scene.touch_sd = read_displacement(e); }},
               {"slip_sd", [&](const Entry& e) { scene.slip_sd = read_displacement(e); }},
               {"bins", [&](const Entry& e) { read_bins(e, scene); }},
               {"filter",
                [&](const Entry& e) {
                  scene.filter = e.one_of<std::string>({{"auto", "auto"},
                                                        {"histogram", "histogram"},
                                                        {"bounded", "bounded"},
                                                        {"particles", "particles"}});
                }},
               {"act_below_mm", number(scene.act_below_mm, above_0, "give a number above 0")},
               {"act_above", number(scene.act_above, probability, "give a number in [0, 1]")},
               {"device", [&](const Entry& e) { scene.device = e.text(); }}});
  });
  return scene;
}

}  // namespace palpate
