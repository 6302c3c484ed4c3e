#include "cli/commands.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/map_flags.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "figures/figures.hpp"
#include "learning/map_task.hpp"
#include "model/option_words.hpp"
#include "palpate/device.hpp"
#include "palpate/files.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

void add_map_flags(CLI::App& command, MapFlags& flags) {
  add_required(command, "RECORDING", flags.recordings,
               "Recordings of touches (HDF5), or drawings (PNG), each of one object");
  add_required(
      command, "-o,--output", flags.output,
      "Map to write (HDF5), or FOLDER/ for one map of each object, or several with --unposed");
  command
      .add_option("--cell-mm", flags.cell_mm,
                  "Edge of a cell, mm; with --unposed by default half the distance of neighbouring "
                  "elements")
      ->default_str("0.5");
  command.add_option("--spread-mm", flags.spread_mm,
                     "Standard deviation of the inverse sensor model, mm [default: a quarter of "
                     "the distance of neighbouring elements; 0.5 for DigiTacts, for one element "
                     "and for drawings; with --unposed 0.6 times that distance]");
  command.add_option("--peak", flags.peak,
                     "Peak of the inverse sensor model, a probability p below 1 [default: 0.9]; of "
                     "a drawing, whose log odds lie within +-log(p / (1 - p)) [default: 0.999]");
  command
      .add_option(
          "--prior", flags.prior,
          "Probability that an unseen cell is occupied; auto: the area of all objects divided by "
          "the area that their maps cover, with --unposed the share of elements in contact")
      ->default_str("auto");
  Request& request = flags.shared;
  add_option_flag(command, request, "threshold",
                  "Contact threshold, in the recording's pressure unit [default: learned where "
                  "--unposed learns the sensor; else 2 kPa, and required for raw pressure]");
  add_option_flag(command, request, "ratio",
                  "Threshold as a fraction of the touch's largest pressure [default: 0.3]");
  add_option_flag(
      command, request, "sensor-model",
      "Sensor model (YAML) whose threshold, ratio, spread and prior are the defaults; none learns "
      "no sensor [default: into a FOLDER/, the sensor is learned from the touches, and "
      "FOLDER/sensor.yaml is written where it is better than Eq. 7 on touches that are left out]");
  add_option_flag(command, request, "touch-sd-mm",
                  "How exact the robot's poses are: standard deviation of the sensor's true "
                  "position about the reported one, along x and along y, mm. The touches are "
                  "aligned to the map that they make [default: 0, exact]");
  add_option_flag(command, request, "touch-sd-deg",
                  "The same of the sensor's angle, degrees [default: 0]");
  add_option_flag(command, request, "frames");
  command.add_option(
      "--symmetry", flags.symmetry,
      "n-fold rotational symmetry, where 1 is none and 0 any rotation; of all objects, or of some, "
      "such as nut=6,key=1. Where the map looks the same after turns, recognition takes them as "
      "equal once touches cannot tell them apart [default: 1]");
  command.add_option(
      "--origin", flags.origin,
      "Where the object's frame lies in the robot frame of the touches: robot, at its origin; "
      "centroid, at the middle of the occupied cells; X,Y,DEG, in mm and degrees; auto, at the "
      "robot's origin where the map covers it, else at the centroid. Of a drawing, in the frame of "
      "the picture's lower left corner, auto: at the centroid [default: auto]");
  command.add_flag("--mirror", flags.mirror,
                   "The object is flat and may lie on its other side; with --unposed, presses of "
                   "that side join the maps mirrored");
  command.add_option(
      "--label", flags.label,
      "Label of the map [default: the object that the recording names, or a drawing's file]");
  command.add_option(
      "--group", flags.group,
      "How touches are grouped, such as by the person or the day that made them. A group is left "
      "out as a whole where it is learned how sure to be, so that this holds for other people and "
      "days: recording, a group a file; label, a group for each GROUP of recordings whose object "
      "is LABEL@GROUP, of which LABEL is the map's");
  command.add_flag(
      "--unposed", flags.unposed,
      "The sensor's poses are unknown: find how the presses of an object lie beside each other, "
      "and build its maps from their means. For arrays so large that a press shows much of the "
      "object. Lists presses that fit poorly, and leaves out those that fit nowhere");
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

void build_maps(const MapFlags& flags) {
  require_no_drawing_flags(flags);
  const std::vector<Recording> recordings = read_touch_recordings(flags.recordings);
  const MapTask task = map_task(flags, recordings);
  prepare_outputs(flags, task.names(), task.learns_sensor);
  std::ranges::for_each(task.remarks, tell_on_stderr);
  std::optional<Device> device;  // opened once it is needed
  const auto open_device = [&]() -> Device& {
    return device ? *device : device.emplace(Device::open(flags.shared.device));
  };
  const LearnedMaps learned = with_progress(
      "learning maps", [&](const auto& show) { return learn_maps(task, open_device, show); });
  std::ranges::for_each(learned.remarks, tell_on_stderr);
  write_maps(flags, learned);
}

void make_maps(const MapFlags& flags) {
  if (flags.of_drawings()) {
    build_drawn_maps(flags);
  } else {
    build_maps(flags);
  }
}

}  // namespace

void prepare_outputs(const MapFlags& flags, const std::vector<std::string>& names,
                     bool with_sensor) {
  CommandFiles files;
  files.reads("RECORDING", flags.recordings);
  if (flags.shared.sensor_model != no_sensor_model) {
    files.reads("--sensor-model", flags.shared.sensor_model);
  }
  if (std::error_code none; std::filesystem::is_regular_file(flags.array, none)) {
    files.reads("--array", flags.array);
  }
  const auto writes = [&](const std::filesystem::path& file) {
    if (flags.to_folder()) {
      files.writes_in("-o", file.parent_path(), file.filename().string());
    } else {
      files.writes("-o", file);
    }
  };
  for (const std::string& name : names) {
    writes(flags.map_file(name));
    for (const char* extension : {".yaml", ".pgm"}) {
      files.writes_in("--ros", flags.ros, name + extension);
    }
  }
  if (with_sensor) {
    writes(flags.sensor_file());
  }
  files.writes("--png", flags.png);
  files.prepare();
}

void write_maps(const MapFlags& flags, const LearnedMaps& learned) {
  // Drawn before anything is written, so that a failure leaves nothing behind.
  std::vector<OccupancyGrid> drawn;
  for (const auto& [name, map] : learned.maps) {
    drawn.push_back(map);
    drawn.back().label = name;
  }
  const std::string picture = flags.png.empty() ? "" : draw_maps(drawn);
  if (!flags.ros.empty()) {
    make_folder(flags.ros);
  }
  save(flags, learned);
  for (const std::string& line : learned.words) {
    fmt::print("{}\n", in_flags(line));
  }
  for (std::size_t i = 0; i < drawn.size() && !flags.ros.empty(); ++i) {
    const auto yaml = std::filesystem::path(flags.ros) / (learned.maps[i].name + ".yaml");
    write_map_server(yaml, learned.maps[i].map);
    fmt::print("{}\n", yaml.string());
  }
  if (!flags.png.empty()) {
    write_file(flags.png, picture);
    fmt::print("{}\n", flags.png);
  }
}

void add_map(CLI::App& app) {
  const auto [command, flags] =
      add_command<MapFlags>(app, "map",
                            "Build an object's occupancy grid from touches at known poses, with "
                            "--unposed from presses at unknown poses, or from a drawing",
                            make_maps);
  flags->command = command;
  add_map_flags(*command, *flags);
  add_drawing_flags(*command, *flags);
}

}  // namespace palpate::cli
