#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>
#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "io/file_format.hpp"
#include "io/file_summary.hpp"
#include "io/hdf5_contents.hpp"
#include "io/hdf5_writer.hpp"
#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "palpate/files.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

namespace {

void require_sound(const std::filesystem::path& path, const std::optional<std::string>& fault) {
  if (fault) {
    refuse(path, "{}", *fault);
  }
}

/// Opens a map file.
Hdf5Contents open_map(const std::filesystem::path& path) {
  return {path,
          {"format", "version", "label", "cell_mm", "origin_mm", "prior", "symmetry", "spread_mm",
           "suggested_symmetry", "mirror", "T_learned_robot_object", "centred_mm", "drawn",
           // of the touches
           "pressure_unit", "threshold", "ratio", "peak", "left_out_fit", "pose_scale", "groups"},
          {"log_odds", "observations", "mean_level", "touch_pressure", "touch_pose",
           "touch_elements", "touch_valid"}};
}

/// Reads and checks the map without its cells.
OccupancyGrid read_map_head(const std::filesystem::path& path, const Hdf5Contents& file) {
  require_format(file, map_format);
  OccupancyGrid map;
  map.label = file.text("label");
  map.cell_mm = file.number("cell_mm");
  const std::vector<double> origin = file.numbers("origin_mm", 2);
  map.origin_mm = {origin[0], origin[1]};
  map.prior = file.number("prior");
  map.symmetry = file.integer("symmetry", 0);
  if (file.has_attribute("spread_mm")) {  // other programs' maps may have none
    map.spread_mm = file.number("spread_mm");
  }
  if (file.has_attribute("suggested_symmetry")) {
    map.suggested_symmetry = file.integer("suggested_symmetry", 0);
  }
  if (file.has_attribute("T_learned_robot_object")) {
    const std::vector<double> pose = file.numbers("T_learned_robot_object", 3);
    map.T_learned_robot_object = {{pose[0], pose[1]}, pose[2]};
  }
  if (file.has_attribute("centred_mm")) {
    const std::vector<double> moved = file.numbers("centred_mm", 2);
    map.centred_mm = {moved[0], moved[1]};
  }
  map.mirror = file.has_attribute("mirror") && file.integer("mirror", 0) != 0;
  map.drawn = file.has_attribute("drawn") && file.integer("drawn", 0) != 0;
  const std::vector<std::uint64_t>& shape = file.shape("log_odds", 2);
  const auto [least, largest] = std::minmax(shape[0], shape[1]);
  if (least < 1 || largest > std::numeric_limits<int>::max()) {
    file.refuse("dataset 'log_odds' has the shape {}; store at least one cell", shape);
  }
  map.ny = static_cast<int>(shape[0]);
  map.nx = static_cast<int>(shape[1]);
  require_text(path, "attribute 'label'", map.label);
  require_sound(path, fault_without_cells(map));
  return map;
}

/// Reads and checks the log odds, holding a few MB of them at a time.
/// @param cells called with them in row-major order, in pieces
void read_cells(const std::filesystem::path& path, const Hdf5Contents& file,
                const OccupancyGrid& head,
                const std::function<void(std::span<const float>)>& cells) {
  std::vector<float> narrow;
  file.read("log_odds", [&](std::uint64_t first, std::span<const double> log_odds) {
    narrow.assign(log_odds.begin(), log_odds.end());
    require_sound(path, fault_of_cells(head, first, narrow));
    cells(narrow);
  });
}

/// All values of a dataset of this shape.
template <typename Value = double>
std::vector<Value> read_all(const Hdf5Contents& file, const char* name,
                            const std::vector<std::uint64_t>& shape,
                            const char* remedy = "build the map anew") {
  if (file.shape(name) != shape) {
    file.refuse("dataset '{}' has the shape {}, not {}; {}", name, file.shape(name), shape, remedy);
  }
  return file.read<Value>(name);
}

/// The groups of `touches` touches, as write_groups() wrote them.
std::vector<std::string> read_groups(const Hdf5Contents& file, std::uint64_t touches) {
  std::vector<std::string> groups;
  const auto runs = nlohmann::json::parse(file.text("groups"), nullptr, false);
  try {
    for (const nlohmann::json& run : runs.get<nlohmann::json::array_t>()) {
      const auto count = run.at(1).get<std::uint64_t>();
      if (count > touches - groups.size()) {
        break;
      }
      groups.insert(groups.end(), count, run.at(0).get<std::string>());
    }
  } catch (const nlohmann::json::exception&) {
    groups.clear();
  }
  if (groups.size() != touches) {
    file.refuse("attribute 'groups' does not name the groups of {} touches; build the map anew",
                touches);
  }
  return groups;
}

/// As a JSON array of [group, touches in a row].
void write_groups(Hdf5Writer& file, const std::vector<std::string>& groups) {
  auto runs = nlohmann::json::array();
  for (auto first = groups.begin(); first != groups.end();) {
    const auto last = std::find_if(first, groups.end(),
                                   [&](const std::string& group) { return group != *first; });
    runs.push_back({*first, last - first});
    first = last;
  }
  // A path need not be UTF-8.
  file.attribute("groups", runs.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

/// Reads what the map was built from, where the file has it.
std::shared_ptr<const MapSource> read_source(const std::filesystem::path& path,
                                             const Hdf5Contents& file, const OccupancyGrid& map) {
  if (!file.has_dataset("touch_pressure") || !map.spread_mm) {
    return {};
  }
  auto source = std::make_shared<MapSource>();
  source->options = {
      .cell_mm = map.cell_mm,
      .sensor = {.spread_mm = *map.spread_mm, .peak = file.number("peak"), .prior = map.prior},
      .classifier = {.threshold = file.number("threshold"), .ratio = file.number("ratio")}};
  Recording& touches = source->touches;
  touches.path = path.string();
  touches.object = map.label;
  touches.pressure_unit = file.text("pressure_unit");
  const std::uint64_t n = file.shape("touch_pressure", 2)[0];
  const std::uint64_t e = file.shape("touch_pressure", 2)[1];
  constexpr std::uint64_t limit = std::uint64_t{1} << 40;
  if (n == 0 || e == 0 || n > limit / e) {
    file.refuse("dataset 'touch_pressure' has the shape [{}, {}]; build the map anew", n, e);
  }
  touches.pressure = read_all(file, "touch_pressure", {n, e});
  touches.T_robot_sensor = read_all<Pose>(file, "touch_pose", {n, 3});
  const bool changes = file.shape("touch_elements").size() == 3;
  touches.elements_mm = changes ? read_all<glm::dvec2>(file, "touch_elements", {n, e, 2})
                                : read_all<glm::dvec2>(file, "touch_elements", {e, 2});
  const auto require = [&](bool is_sound, const char* name, const std::vector<double>& pair) {
    if (!is_sound) {
      file.refuse("attribute '{}' is {}, {}; build the map anew", name, pair[0], pair[1]);
    }
  };
  if (file.has_attribute("left_out_fit")) {
    const std::vector<double> z = file.numbers("left_out_fit", 2);
    require(z[1] > 0.0, "left_out_fit", z);
    source->left_out = FitScale{.mean = z[0], .sd = z[1]};
  }
  if (file.has_attribute("pose_scale")) {
    const std::vector<double> scale = file.numbers("pose_scale", 2);
    require(scale[0] > 0.0 && scale[1] >= 0.0, "pose_scale", scale);
    source->pose_scale = PoseScale{.factor = scale[0], .map_sd_mm = scale[1]};
  }
  if (file.has_attribute("groups")) {
    source->groups = read_groups(file, n);
  }
  if (file.has_dataset("touch_valid")) {
    touches.valid = read_all<std::uint8_t>(file, "touch_valid", {n, e});
  }
  return source;
}

void write_source(Hdf5Writer& file, const MapSource& source) {
  const Recording& touches = source.touches;
  const std::size_t n = touches.size();
  const std::size_t e = touches.elements();
  file.attribute("pressure_unit", touches.pressure_unit);
  file.attribute("threshold", source.options.classifier.threshold);
  file.attribute("ratio", source.options.classifier.ratio);
  file.attribute("peak", source.options.sensor.peak);
  if (source.left_out) {
    file.attribute("left_out_fit", {source.left_out->mean, source.left_out->sd});
  }
  if (source.pose_scale) {
    file.attribute("pose_scale", {source.pose_scale->factor, source.pose_scale->map_sd_mm});
  }
  if (!source.groups.empty()) {
    write_groups(file, source.groups);
  }
  constexpr auto compressed = Hdf5Writer::Storage::compressed;
  file.dataset("touch_pressure", {n, e}, touches.pressure, compressed);
  file.dataset("touch_pose", {n, 3}, touches.T_robot_sensor);
  const bool changes = touches.elements_mm.size() != e;
  file.dataset("touch_elements", changes ? Hdf5Writer::Shape{n, e, 2} : Hdf5Writer::Shape{e, 2},
               touches.elements_mm, changes ? compressed : Hdf5Writer::Storage::plain);
  if (!touches.valid.empty()) {
    file.dataset("touch_valid", {n, e}, touches.valid, compressed);
  }
}

// map_server's default thresholds, and the grey levels that its map_saver writes.
constexpr double occupied_threshold = 0.65;
constexpr double free_threshold = 0.196;
constexpr char occupied_grey = 0;
constexpr char free_grey = static_cast<char>(254);
constexpr char unknown_grey = static_cast<char>(205);

std::string image_of(const OccupancyGrid& map) {
  std::string image = fmt::format("P5\n{} {}\n255\n", map.nx, map.ny);
  // Unseen cells hold exactly the prior, which may lie below the free threshold.
  const auto unseen = static_cast<float>(map.prior_log_odds());
  for (int j = map.ny - 1; j >= 0; --j) {
    for (int i = 0; i < map.nx; ++i) {
      const float log_odds = map.at(i, j);
      const double p = probability_from_log_odds(log_odds);
      image += log_odds == unseen       ? unknown_grey
               : p > occupied_threshold ? occupied_grey
               : p < free_threshold     ? free_grey
                                        : unknown_grey;
    }
  }
  return image;
}

}  // namespace

MapSummary summarize_map(const std::filesystem::path& path) {
  const Hdf5Contents file = open_map(path);
  MapSummary summary{.head = read_map_head(path, file), .log_odds = {}};
  std::optional<Extremes> log_odds;
  read_cells(path, file, summary.head, [&](std::span<const float> cells) {
    for (const float cell : cells) {
      include(log_odds, cell);
      summary.occupied += cell > 0.0F ? 1 : 0;
    }
  });
  summary.log_odds = log_odds.value();  // no map is without cells
  return summary;
}

OccupancyGrid read_map(const std::filesystem::path& path) {
  const Hdf5Contents file = open_map(path);
  OccupancyGrid map = read_map_head(path, file);
  map.file = path.string();
  map.log_odds.reserve(static_cast<std::size_t>(map.nx) * static_cast<std::size_t>(map.ny));
  read_cells(path, file, map, [&](std::span<const float> cells) {
    map.log_odds.insert(map.log_odds.end(), cells.begin(), cells.end());
  });
  for (const auto& [name, layer] :
       {std::pair{"observations", &map.observations}, {"mean_level", &map.mean_level}}) {
    if (file.has_dataset(name)) {
      *layer = read_all<float>(file, name, file.shape("log_odds"),
                               "store one number for each cell, as in 'log_odds'");
    }
  }
  map.source = read_source(path, file, map);
  require_sound(path, fault_of(map));
  return map;
}

void write_map(const std::filesystem::path& path, const OccupancyGrid& map) {
  require_text(path, "attribute 'label'", map.label);
  require_sound(path, fault_of(map));
  Hdf5Writer file(path);
  write_format(file, map_format);
  file.attribute("label", map.label);
  file.attribute("cell_mm", map.cell_mm);
  file.attribute("origin_mm", {map.origin_mm.x, map.origin_mm.y});
  file.attribute("prior", map.prior);
  file.attribute("symmetry", map.symmetry);
  if (map.spread_mm) {
    file.attribute("spread_mm", *map.spread_mm);
  }
  for (const auto& [name, holds] : {std::pair{"mirror", map.mirror}, {"drawn", map.drawn}}) {
    if (holds) {
      file.attribute(name, 1);
    }
  }
  if (map.suggested_symmetry) {
    file.attribute("suggested_symmetry", *map.suggested_symmetry);
  }
  const Pose& learned = map.T_learned_robot_object;
  file.attribute("T_learned_robot_object",
                 {learned.translation_mm.x, learned.translation_mm.y, learned.theta_rad});
  if (map.centred_mm != glm::dvec2(0.0)) {
    file.attribute("centred_mm", {map.centred_mm.x, map.centred_mm.y});
  }
  const std::vector<std::size_t> shape{static_cast<std::size_t>(map.ny),
                                       static_cast<std::size_t>(map.nx)};
  for (const auto& [name, numbers] : {std::pair{"log_odds", &map.log_odds},
                                      {"observations", &map.observations},
                                      {"mean_level", &map.mean_level}}) {
    if (!numbers->empty()) {
      file.dataset(name, shape, *numbers);
    }
  }
  if (map.source) {
    write_source(file, *map.source);
  }
  file.save();
}

void write_map_server(const std::filesystem::path& yaml_path, const OccupancyGrid& map) {
  if (yaml_path.extension() != ".yaml") {
    refuse(yaml_path, "is not named as a map_server map; end its name in .yaml");
  }
  require_sound(yaml_path, fault_of(map));
  std::filesystem::path image_path = yaml_path;
  image_path.replace_extension(".pgm");
  constexpr double metres_per_mm = 1e-3;
  // The origin is the corner, not the centre, of the lower left pixel.
  const glm::dvec2 corner_mm = map.origin_mm - 0.5 * map.cell_mm;
  YAML::Emitter image_name;  // in quotes where YAML wants them
  image_name << image_path.filename().string();
  const std::string yaml = fmt::format(
      "image: {}\nmode: trinary\nresolution: {:.12g}\norigin: [{:.12g}, {:.12g}, 0]\nnegate: 0\n"
      "occupied_thresh: {:.12g}\nfree_thresh: {:.12g}\n",
      image_name.c_str(), map.cell_mm * metres_per_mm, corner_mm.x * metres_per_mm,
      corner_mm.y * metres_per_mm, occupied_threshold, free_threshold);

  AtomicFile image_file(image_path);
  AtomicFile yaml_file(yaml_path);
  image_file.write(image_of(map));
  yaml_file.write(yaml);
  // The image first: the YAML that names it must not appear without it.
  image_file.commit();
  yaml_file.commit();
}

}  // namespace palpate
