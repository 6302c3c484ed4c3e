#include "palpate/files.hpp"

#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/input_file.hpp"
#include "io/pressure_table.hpp"
#include "options/option.hpp"
#include "palpate/touch.hpp"
#include "yaml/yaml_entry.hpp"

namespace palpate {

namespace {

using Entry = YamlEntry;

glm::dvec2 read_point(const Entry& entry) {
  const std::vector<Entry> entries = entry.list(2, "give [x, y]");
  return {entries[0].number(), entries[1].number()};
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

/// The option's value as a flag has it: a list's numbers are joined as in "25x25x16".
std::string text_of(const Entry& entry, const Option& option) {
  const std::optional<char> separator = separator_of(option);
  if (!separator || !entry.node.IsSequence()) {
    return entry.text();
  }
  std::vector<std::string> numbers;
  for (const Entry& item : entry.list("")) {
    numbers.push_back(item.text());
  }
  return fmt::format("{}", fmt::join(numbers, std::string(1, *separator)));
}

void read_option(const Entry& entry, const Option& option, Scene& scene) {
  std::string text = text_of(entry, option);
  Request request;
  if (const std::string remedy = set_option(request, option, text); !remedy.empty()) {
    const bool shown = entry.node.IsScalar() || text.size() > 60;  // a message is one short line
    entry.refuse(shown ? remedy : fmt::format("{}: {}", text, remedy));
  }
  const bool names_file = option.member == Option::Member(&Request::sensor_model);
  if (names_file && text != no_sensor_model) {
    text = (entry.file.parent_path() / text).string();
  }
  scene.options[option.name] = std::move(text);
}

/// Adds the keys of the options that stand in the section, "" for the scene itself.
void add_option_keys(std::string_view section, Scene& scene, YamlKeys& keys) {
  for (const Option& option : options()) {
    const std::string_view path = option.scene_key;
    const std::size_t dot = path.find('.');
    const std::string_view in = dot == path.npos ? "" : path.substr(0, dot);
    if (!path.empty() && in == section) {
      keys.emplace_back(path.substr(dot == path.npos ? 0 : dot + 1),
                        [&](const Entry& entry) { read_option(entry, option, scene); });
    }
  }
}

}  // namespace

Scene read_scene(const std::filesystem::path& path) {
  require_readable(path);
  Scene scene;
  read_document(std::ifstream(path), path, "the scene", [&](const Entry& root) {
    if (root.node.IsNull()) {
      return;  // comments alone: everything is left out
    }
    YamlKeys keys{{"array", [&](const Entry& e) { read_array(e, scene); }},
                  {"objects", [&](const Entry& e) {
                     for (const Entry& object : e.list("give a list of {map: FILE}")) {
                       scene.objects.push_back(read_object(object));
                     }
                   }}};
    for (const char* section : {"region", "touch_sd", "slip_sd"}) {
      keys.emplace_back(section, [&scene, section](const Entry& entry) {
        YamlKeys inner;
        add_option_keys(section, scene, inner);
        read_keys(entry, inner);
      });
    }
    add_option_keys("", scene, keys);
    read_keys(root, keys);
  });
  return scene;
}

}  // namespace palpate
