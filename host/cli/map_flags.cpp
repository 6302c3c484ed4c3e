#include "cli/map_flags.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <sstream>
#include <tuple>

#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/map_drawing.hpp"
#include "cli/options.hpp"
#include "cli/recognition_flags.hpp"
#include "model/element_spacing.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "options/option.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

/// The value of a flag that is a cell's edge or a spread.
double require_length(const std::string& flag, double mm) {
  require_above(flag, mm, 0.0);
  if (!(mm >= least_length_mm && mm <= most_length_mm)) {
    refuse_flag(flag, mm, "give {:g} to {:g} mm", least_length_mm, most_length_mm);
  }
  return mm;
}

/// Whether --sensor-model names a file.
bool has_sensor_model(const MapFlags& flags) {
  return !flags.request.sensor_model.empty() && flags.request.sensor_model != no_sensor_model;
}

}  // namespace

bool MapFlags::to_folder() const {
  std::error_code ignored;
  return output.ends_with('/') || std::filesystem::is_directory(output, ignored);
}

void add_map_flags(CLI::App& command, MapFlags& flags) {
  command
      .add_option("RECORDING", flags.recordings,
                  "Recordings of touches (HDF5), or drawings (PNG), each of one object")
      ->required();
  command
      .add_option("-o,--output", flags.output,
                  "Map to write (HDF5), or FOLDER/ for one map of each object, or several with "
                  "--unposed")
      ->required();
  command
      .add_option("--cell-mm", flags.cell_mm,
                  "Edge of a cell, mm; with --unposed by default half the distance of neighbouring "
                  "elements")
      ->capture_default_str();
  command.add_option("--spread-mm", flags.spread_mm,
                     "Standard deviation of the inverse sensor model, mm [default: a quarter of "
                     "the distance of neighbouring elements; 0.5 for DigiTacts, for one element "
                     "and for drawings; with --unposed 0.6 times that distance]");
  command.add_option(
      "--peak", flags.peak,
      "Peak of the inverse sensor model, a probability p below 1 [default: 0.9]; of a "
      "drawing, whose log odds lie within +-log(p / (1 - p)) [default: 0.999]");
  command
      .add_option("--prior", flags.prior,
                  "Probability that an unseen cell is occupied; auto: the area of all objects "
                  "divided by the area that their maps cover, with --unposed the share of elements "
                  "in contact")
      ->capture_default_str();
  Request& request = flags.request;
  add_option_flag(command, request, "threshold",
                  "Contact threshold, in the recording's pressure unit [default: learned where "
                  "--unposed learns the sensor; else 2 kPa, and required for raw pressure]");
  add_option_flag(command, request, "ratio",
                  "Threshold as a fraction of the touch's largest pressure [default: 0.3]");
  add_option_flag(command, request, "sensor-model",
                  "Sensor model (YAML) whose threshold, ratio, spread and prior are the "
                  "defaults; none learns no sensor [default: into a FOLDER/, the sensor is "
                  "learned from the touches, and FOLDER/sensor.yaml is written where it is "
                  "better than Eq. 7 on touches that are left out]");
  add_option_flag(command, request, "touch-sd-mm",
                  "How exact the robot's poses are: standard deviation of the sensor's true "
                  "position about the reported one, along x and along y, mm. The touches are "
                  "aligned to the map that they make [default: 0, exact]");
  add_option_flag(command, request, "touch-sd-deg",
                  "The same of the sensor's angle, degrees [default: 0]");
  add_option_flag(command, request, "frames");
  command.add_option("--symmetry", flags.symmetry,
                     "n-fold rotational symmetry, where 1 is none and 0 any rotation; of all "
                     "objects, or of some, such as nut=6,key=1. Where the map looks the same after "
                     "turns, recognition takes them as equal once touches cannot tell them apart "
                     "[default: 1]");
  command.add_option(
      "--origin", flags.origin,
      "Where the object's frame lies in the robot frame of the touches: robot, at "
      "its origin; centroid, at the middle of the occupied cells; X,Y,DEG, in mm and "
      "degrees; auto, at the robot's origin where the map covers it, else at the "
      "centroid. Of a drawing, in the frame of the picture's lower left corner, auto: at the "
      "centroid [default: auto]");
  command.add_flag("--mirror", flags.mirror,
                   "The object is flat and may lie on its other side; with --unposed, presses of "
                   "that side join the maps mirrored");
  command.add_option("--label", flags.label,
                     "Label of the map [default: the object that the recording names, "
                     "or a drawing's file]");
  command.add_option("--group", flags.group,
                     "How touches are grouped, such as by the person or the day that made them. A "
                     "group is left out as a whole where it is learned how sure to be, so that "
                     "this holds for other people and days: recording, a group a file; label, a "
                     "group for each GROUP of recordings whose object is LABEL@GROUP, of which "
                     "LABEL is the map's");
  command.add_flag("--unposed", flags.unposed,
                   "The sensor's poses are unknown: find how the presses of an object lie beside "
                   "each other, and build its maps from their means. For arrays so large that a "
                   "press shows much of the object. Lists presses that fit poorly, and leaves out "
                   "those that fit nowhere");
  command
      .add_option("--max-maps", flags.max_maps,
                  "With --unposed, most maps of an object: presses that do not fit a map begin "
                  "another, FOLDER/LABEL.2.map.h5. More maps recognise better and take longer. "
                  "Where there are no more presses than maps, each press keeps a map of its own "
                  "[default: 4 into a FOLDER/, 1 into a MAP]")
      ->check(require_whole_number);
  command.add_option("--png", flags.png, "Picture to write (PNG): all maps side by side");
  command.add_option("--ros", flags.ros,
                     "Folder to write every map to as PGM and YAML, for ROS's map_server");
  add_option_flag(command, request, "device",
                  "Vulkan device, by index or a part of its name; --unposed uses none");
}

void finish_map_flags(const CLI::App& command, MapFlags& flags) {
  flags.cell_given = command.count("--cell-mm") > 0;
  flags.prior_given = command.count("--prior") > 0;
  if (!is_printable(flags.label)) {
    refuse("--label", "give printable text, in UTF-8");
  }
  if (flags.label == none_label) {
    refuse_flag("--label", none_label,
                "stands for objects that were never learned; choose another label");
  }
  for (const auto& [flag, sd, most] :
       {std::tuple{"--touch-sd-mm", flags.request.touch_sd_mm, most_length_mm},
        {"--touch-sd-deg", flags.request.touch_sd_deg, 180.0}}) {
    if (sd && !(*sd >= 0.0 && *sd <= most)) {
      refuse_flag(flag, *sd, "give 0 to {:g}", most);
    }
    if (sd && flags.unposed) {
      refuse_flag(flag, *sd, "presses at unknown poses are placed anyway; leave it out");
    }
  }
  if (!flags.of_drawings()) {
    require_no_drawing_flags(flags);
  }
  if (flags.max_maps && !flags.unposed) {
    refuse_flag("--max-maps", *flags.max_maps,
                "only presses at unknown poses make several maps; give --unposed, or leave it out");
  }
}

std::optional<LearnedSensor> sensor_of(const MapFlags& flags,
                                       const std::vector<Recording>& recordings) {
  if (!has_sensor_model(flags)) {
    return {};
  }
  LearnedSensor sensor = read_sensor_model(flags.request.sensor_model);
  const Recording& first = recordings.front();
  if (sensor.pressure_unit != first.pressure_unit) {
    refuse(flags.request.sensor_model,
           "pressure_unit is {} but {} has {}; give a sensor model that was learned from such "
           "recordings",
           sensor.pressure_unit, first.path, first.pressure_unit);
  }
  return sensor;
}

MapOptions map_options(const MapFlags& flags, const std::vector<Recording>& recordings,
                       const std::optional<LearnedSensor>& sensor) {
  MapOptions result;
  result.cell_mm = require_length("--cell-mm", flags.cell_mm);
  if (flags.spread_mm) {
    result.sensor.spread_mm = require_length("--spread-mm", *flags.spread_mm);
  } else {
    result.sensor.spread_mm = sensor ? sensor->spread_mm : usual_spread_mm(recordings);
  }
  result.sensor.peak = require_above("--peak", flags.peak.value_or(result.sensor.peak), 0.0);
  if (result.sensor.peak >= 1.0) {
    refuse_flag("--peak", result.sensor.peak,
                "must be below 1, or one reading would make a cell certain");
  }
  std::optional<double> threshold = flags.request.threshold;
  std::optional<double> ratio = flags.request.ratio;
  if (sensor) {
    threshold = threshold.value_or(sensor->classifier.threshold);
    ratio = ratio.value_or(sensor->classifier.ratio);
  }
  const Recording& first = recordings.front();
  result.classifier = make_classifier(first.pressure_unit, first.path, threshold, ratio);
  return result;
}

DisplacementSd touch_sd(const MapFlags& flags) {
  return {flags.request.touch_sd_mm.value_or(0.0),
          radians(flags.request.touch_sd_deg.value_or(0.0))};
}

std::optional<double> given_prior(const MapFlags& flags,
                                  const std::optional<LearnedSensor>& sensor) {
  if (sensor && !flags.prior_given) {
    return sensor->prior;
  }
  if (flags.prior == "auto") {
    return {};
  }
  const std::optional<double> prior = number_of(flags.prior);
  if (!prior || !(*prior > 0.0 && *prior < 1.0)) {
    refuse_flag("--prior", flags.prior, "give auto, or a probability between 0 and 1");
  }
  return prior;
}

namespace {

/// --symmetry as LABEL=N, by label; a number alone stands under "".
std::map<std::string, int> symmetries_of(const MapFlags& flags) {
  std::map<std::string, int> result;
  std::istringstream items(flags.symmetry);
  for (std::string item; std::getline(items, item, ',');) {
    const std::size_t equals = item.rfind('=');
    const std::string label = equals == std::string::npos ? "" : item.substr(0, equals);
    const std::string n = equals == std::string::npos ? item : item.substr(equals + 1);
    const auto whole = number_of(n);
    if (!require_whole_number(n).empty() || !whole || *whole > std::numeric_limits<int>::max() ||
        (label.empty() && item != flags.symmetry) || !result.emplace(label, *whole).second) {
      refuse_flag(
          "--symmetry", flags.symmetry,
          "give a whole number from 0, or one for each of some labels, such as nut=6,key=1");
    }
  }
  return result;
}

}  // namespace

void require_name(const std::string& path, const std::string& label) {
  if (label.empty()) {
    refuse(path, "attribute 'object' is empty; name the object with --label");
  }
  if (label == none_label) {
    refuse(path,
           "object '{}' stands for objects that were never learned; choose another name with "
           "--label",
           label);
  }
  if (label.find('/') != std::string::npos) {
    refuse(path, "object '{}' holds a '/' and cannot name a file; choose another name with --label",
           label);
  }
}

void require_known_symmetries(const MapFlags& flags, const std::vector<std::string>& labels) {
  for (const auto& [label, n] : symmetries_of(flags)) {
    if (!label.empty() && std::ranges::find(labels, label) == labels.end()) {
      refuse_flag("--symmetry", flags.symmetry, "no object is named {}; there {} {}", label,
                  labels.size() == 1 ? "is" : "are", fmt::format("{}", fmt::join(labels, ", ")));
    }
  }
}

std::optional<RotationalSymmetry> settle_symmetry(const MapFlags& flags, OccupancyGrid& map) {
  const std::map<std::string, int> given = symmetries_of(flags);
  const auto own = given.contains(map.label) ? given.find(map.label) : given.find("");
  const bool none = own != given.end() && own->second == 1;
  map.symmetry = own == given.end() ? 1 : own->second;
  const std::optional<RotationalSymmetry> measured = measure_symmetry(map);
  map.suggested_symmetry = measured && !none ? std::optional(measured->suggested) : std::nullopt;
  return measured;
}

ObjectOrigin object_origin(const MapFlags& flags) {
  using Kind = ObjectOrigin::Kind;
  if (flags.unposed && !flags.origin.empty()) {
    refuse_flag("--origin", flags.origin,
                "presses at unknown poses tell of no robot frame; leave it out");
  }
  const std::map<std::string, Kind> kinds{{"", Kind::automatic},
                                          {"auto", Kind::automatic},
                                          {"centroid", Kind::centroid},
                                          {"robot", Kind::robot}};
  if (const auto known = kinds.find(flags.origin); known != kinds.end()) {
    return {known->second};
  }
  if (std::ranges::count(flags.origin, ',') != 2) {
    refuse_flag("--origin", flags.origin,
                "give auto, centroid, robot, or the frame's pose X,Y,DEG in the robot frame, mm "
                "and degrees");
  }
  return {Kind::given, parse_pose("--origin", flags.origin)};
}

std::filesystem::path map_path(const MapFlags& flags, const std::string& name) {
  return flags.to_folder() ? std::filesystem::path(flags.output) / (name + ".map.h5")
                           : std::filesystem::path(flags.output);
}

std::filesystem::path ros_path(const MapFlags& flags, const std::string& name) {
  return std::filesystem::path(flags.ros) / (name + ".yaml");
}

void prepare_outputs(const MapFlags& flags, const std::vector<std::filesystem::path>& map_paths,
                     const std::vector<std::string>& names) {
  CommandFiles files;
  for (const std::string& recording : flags.recordings) {
    files.reads("RECORDING", recording);
  }
  if (has_sensor_model(flags)) {
    files.reads("--sensor-model", flags.request.sensor_model);
  }
  if (std::error_code none; std::filesystem::is_regular_file(flags.array, none)) {
    files.reads("--array", flags.array);
  }
  for (const std::filesystem::path& path : map_paths) {
    if (flags.to_folder()) {
      files.writes_in("-o", path.parent_path(), path.filename().string());
    } else {
      files.writes("-o", path);
    }
  }
  if (!flags.png.empty()) {
    files.writes("--png", flags.png);
  }
  if (!flags.ros.empty()) {
    for (const std::string& name : names) {
      const std::filesystem::path yaml = ros_path(flags, name);
      for (const std::filesystem::path& file :
           {yaml, std::filesystem::path(yaml).replace_extension(".pgm")}) {
        files.writes_in("--ros", file.parent_path(), file.filename().string());
      }
    }
  }
  files.prepare();
}

}  // namespace palpate::cli
