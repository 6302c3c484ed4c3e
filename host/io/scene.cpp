#include "palpate/scene.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "element_file.hpp"
#include "input_file.hpp"
#include "number_text.hpp"
#include "palpate/touch.hpp"

namespace palpate {

namespace {

// A node of the scene with what a message about it has to name.
struct Entry {
  const std::filesystem::path& file;
  std::string key;
  YAML::Node node;

  [[noreturn]] void refuse(std::string_view remedy) const {
    const bool shown = node.IsScalar() && is_printable_utf8(node.Scalar());
    const std::string value = shown ? fmt::format(" = '{}'", node.Scalar()) : "";
    palpate::refuse(file,
                    fmt::format("line {}: '{}'{}: {}", node.Mark().line + 1, key, value, remedy));
  }

  double number(
      bool (*fits)(double) = [](double) { return true; },
      const char* remedy = "give a number") const {
    // Not yaml-cpp's conversion, which reads 1.500 as 1500 where the locale has decimal commas.
    const std::optional<double> value = node.IsScalar() ? number_of(node.Scalar()) : std::nullopt;
    if (!value || !fits(*value)) {
      refuse(remedy);
    }
    return *value;
  }

  int integer(int least) const {
    // Not yaml-cpp's conversion either, which reads 010 as 8.
    const auto value = node.IsScalar() ? whole_number_of(node.Scalar()) : std::nullopt;
    if (!value || *value < least || *value > std::numeric_limits<int>::max()) {
      refuse(fmt::format("give a whole number from {}", least));
    }
    return static_cast<int>(*value);
  }

  std::string text() const {
    if (!node.IsScalar() || node.Scalar().empty() || !is_printable_utf8(node.Scalar())) {
      refuse("give a text");
    }
    return node.Scalar();
  }

  std::vector<Entry> list(const char* remedy) const {
    if (!node.IsSequence()) {
      refuse(remedy);
    }
    std::vector<Entry> entries;
    for (const YAML::Node& item : node) {
      entries.push_back({file, fmt::format("{}[{}]", key, entries.size()), item});
    }
    return entries;
  }

  std::array<double, 2> pair(const char* remedy) const {
    const std::vector<Entry> entries = list(remedy);
    if (entries.size() != 2) {
      refuse(remedy);
    }
    return {entries[0].number(), entries[1].number()};
  }

  std::array<double, 2> range() const {
    const std::array<double, 2> ends = pair("give [lower, upper]");
    if (ends[0] > ends[1]) {
      refuse(fmt::format("[{}, {}] is reversed; write the lower end first", ends[0], ends[1]));
    }
    return ends;
  }

  glm::dvec2 point() const {
    const std::array<double, 2> xy = pair("give [x, y]");
    return {xy[0], xy[1]};
  }
};

using Readers = std::vector<std::pair<std::string_view, std::function<void(const Entry&)>>>;

// Hands each value of a map to its key's reader.
void read_keys(const Entry& map, const Readers& readers) {
  std::string known;
  for (const auto& [key, reader] : readers) {
    known += fmt::format("{}{}", known.empty() ? "" : ", ", key);
  }
  if (!map.node.IsMap()) {
    map.refuse(fmt::format("give a map with keys out of {}", known));
  }
  std::set<std::string_view> seen;
  for (const auto& item : map.node) {
    const Entry name{map.file, map.key, item.first};
    const auto found = std::find_if(readers.begin(), readers.end(), [&](const auto& entry) {
      return item.first.IsScalar() && entry.first == item.first.Scalar();
    });
    if (found == readers.end()) {
      name.refuse(fmt::format("unknown key; the keys are {}", known));
    }
    if (!seen.insert(found->first).second) {
      name.refuse("key given twice; remove one");
    }
    found->second({map.file, std::string(found->first), item.second});
  }
}

void read_array(const Entry& array, Scene& scene) {
  if (array.node.IsScalar()) {
    const std::string name = array.text();
    if (name == "digitacts") {
      scene.array_mm = digitacts_array();
    } else {
      scene.array_file = array.file.parent_path() / name;
      scene.array_mm = read_elements(*scene.array_file);
    }
    return;
  }
  std::vector<glm::dvec2> elements;
  for (const Entry& element : array.list("give 'digitacts', a file or a list of [x, y] in mm")) {
    elements.push_back(element.point());
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

Scene::Region read_region(const Entry& entry) {
  Scene::Region region;
  read_keys(entry, {{"x_mm", [&](const Entry& e) { region.x_mm = e.range(); }},
                    {"y_mm", [&](const Entry& e) { region.y_mm = e.range(); }},
                    {"theta_deg", [&](const Entry& e) { region.theta_deg = e.range(); }},
                    {"pivot_mm", [&](const Entry& e) { region.pivot_mm = e.point(); }}});
  return region;
}

void read_bins(const Entry& entry, Scene& scene) {
  if (entry.node.IsScalar() && entry.node.Scalar() == "auto") {
    scene.auto_bins = true;
    return;
  }
  constexpr const char* remedy = "give the counts of bins [x, y, theta], or auto";
  const std::vector<Entry> counts = entry.list(remedy);
  if (counts.size() != 3) {
    entry.refuse(remedy);
  }
  scene.bins = {counts[0].integer(1), counts[1].integer(1), counts[2].integer(1)};
}

std::string read_filter(const Entry& entry) {
  std::string filter = entry.text();
  if (filter != "auto" && filter != "histogram" && filter != "bounded" && filter != "particles") {
    entry.refuse("give auto, histogram, bounded or particles");
  }
  return filter;
}

}  // namespace

Scene read_scene(const std::filesystem::path& path) {
  require_readable(path);
  Scene scene;
  try {
    const Entry root{path, "the scene", YAML::LoadFile(path.string())};
    if (root.node.IsNull()) {
      return scene;  // comments alone: everything is left out
    }
    const auto at_least_0 = [](double value) { return value >= 0; };
    const auto positive = [](double value) { return value > 0; };
    const auto rate = [](double value) { return value >= 0 && value < 1; };
    const auto inner = [](double value) { return value > 0 && value < 1; };
    read_keys(
        root,
        {{"array", [&](const Entry& e) { read_array(e, scene); }},
         {"threshold",
          [&](const Entry& e) { scene.threshold = e.number(at_least_0, "give a number from 0"); }},
         {"ratio",
          [&](const Entry& e) { scene.ratio = e.number(rate, "give a number in [0, 1)"); }},
         {"gamma",
          [&](const Entry& e) { scene.gamma = e.number(rate, "give a number in [0, 1)"); }},
         {"prior",
          [&](const Entry& e) { scene.prior = e.number(inner, "give a number in (0, 1)"); }},
         {"objects", [&](const Entry& e) { scene.objects = read_objects(e); }},
         {"region", [&](const Entry& e) { scene.region = read_region(e); }},
         {"none",
          [&](const Entry& e) { scene.none = e.number(positive, "give a number above 0"); }},
         {"bins", [&](const Entry& e) { read_bins(e, scene); }},
         {"filter", [&](const Entry& e) { scene.filter = read_filter(e); }},
         {"device", [&](const Entry& e) { scene.device = e.text(); }}});
  } catch (const YAML::Exception& error) {
    refuse(path, fmt::format("line {}: {}; correct the YAML", error.mark.line + 1, error.msg));
  }
  return scene;
}

}  // namespace palpate
