#include "commands.hpp"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "command_files.hpp"
#include "figures.hpp"
#include "number_text.hpp"
#include "options.hpp"
#include "palpate/files.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/rotational_symmetry.hpp"
#include "printable.hpp"
#include "progress.hpp"
#include "recordings.hpp"

namespace palpate::cli {

namespace {

struct Options {
  std::vector<std::string> recordings;
  std::string output;
  double cell_mm = 0.5;
  double psf_mm = 1.0;
  std::optional<double> spread_mm;
  double peak = 0.9;
  std::string prior = "auto";
  std::optional<double> threshold;
  std::optional<double> ratio;
  std::string frames;
  int symmetry = 1;
  std::string label;
  std::string png;
  std::string ros;
  std::string device;
};

/// The touches of all recordings, by label.
std::vector<ObjectTouches> group_by_label(const std::vector<Recording>& recordings,
                                          const Options& options,
                                          const ContactClassifier& classifier, bool one_map) {
  std::optional<Frames> frames;
  if (!options.frames.empty()) {
    frames = parse_frames("--frames", options.frames);
  }
  std::map<std::string, std::vector<Touch>> groups;
  for (const Recording& recording : recordings) {
    const std::string& label = options.label.empty() ? recording.object : options.label;
    if (label.empty()) {
      refuse(recording.path, "attribute 'object' is empty; name the object with --label");
    }
    if (label == none_label) {
      refuse(recording.path,
             "object '{}' stands for objects that were never learned; choose another name with "
             "--label",
             label);
    }
    if (label.find('/') != std::string::npos) {
      refuse(recording.path,
             "object '{}' holds a '/' and cannot name a file; choose another name with --label",
             label);
    }
    const auto [begin, end] = select(recording, frames);
    const std::vector<Touch> touches = recording.touches(begin, end);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (const auto fault = fault_of(known_readings(touches[i], classifier))) {
        refuse(recording.path, "sensor_pose[{}]: {}", begin + i, *fault);
      }
    }
    auto& group = groups[label];
    group.insert(group.end(), touches.begin(), touches.end());
    if (one_map && groups.size() > 1) {
      refuse(recording.path,
             "object '{}' differs from '{}' of {}; write a map of each object with -o {}/, or one "
             "map of all touches with --label",
             label, recordings.front().object, recordings.front().path, options.output);
    }
  }
  std::vector<ObjectTouches> objects;
  objects.reserve(groups.size());
  for (auto& [label, touches] : groups) {
    objects.push_back({label, std::move(touches)});
  }
  return objects;
}

/// The value of a flag that is a cell's edge or a spread.
double require_length(const std::string& flag, double mm) {
  require_above(flag, mm, 0.0);
  if (!(mm >= least_length_mm && mm <= most_length_mm)) {
    refuse_flag(flag, mm, "give {:g} to {:g} mm", least_length_mm, most_length_mm);
  }
  return mm;
}

MapOptions map_options(const Options& options, const std::vector<Recording>& recordings) {
  MapOptions result;
  result.cell_mm = require_length("--cell-mm", options.cell_mm);
  result.sensor.spread_mm = require_length("--psf-mm", options.psf_mm) / 2.0;
  if (options.spread_mm) {
    result.sensor.spread_mm = require_length("--spread-mm", *options.spread_mm);
  }
  result.sensor.peak = require_above("--peak", options.peak, 0.0);
  if (options.peak >= 1.0) {
    refuse_flag("--peak", options.peak,
                "must be below 1, or one reading would make a cell certain");
  }
  result.classifier = make_classifier(recordings.front().pressure_unit, recordings.front().path,
                                      options.threshold, options.ratio);
  return result;
}

double parse_prior(const std::string& text) {
  const std::optional<double> prior = number_of(text);
  if (!prior || !(*prior > 0.0 && *prior < 1.0)) {
    refuse_flag("--prior", text, "give auto, or a probability between 0 and 1");
  }
  return *prior;
}

std::filesystem::path ros_path(const Options& options, const std::string& label) {
  return std::filesystem::path(options.ros) / (label + ".yaml");
}

/// Throws Error where an output cannot be written or would overwrite an input.
void prepare_outputs(const Options& options, bool folder,
                     const std::vector<std::filesystem::path>& map_paths,
                     const std::vector<ObjectTouches>& objects) {
  CommandFiles files;
  for (const std::string& recording : options.recordings) {
    files.reads("RECORDING", recording);
  }
  for (const std::filesystem::path& path : map_paths) {
    files.writes("-o", path);
  }
  if (!options.png.empty()) {
    files.writes("--png", options.png);
  }
  if (!options.ros.empty()) {
    for (const ObjectTouches& object : objects) {
      files.writes("--ros", ros_path(options, object.label));
      files.writes("--ros", ros_path(options, object.label).replace_extension(".pgm"));
    }
  }
  files.require_distinct();
  if (!folder) {
    require_writable(options.output);
  }
  if (!options.png.empty()) {
    require_writable(options.png);
  }
}

void add_in_batches(MapBuilder& builder, std::span<const Touch> touches,
                    const std::function<void(double)>& progress) {
  constexpr std::size_t batch = 1000;
  for (std::size_t begin = 0; begin < touches.size(); begin += batch) {
    builder.add(touches.subspan(begin, std::min(batch, touches.size() - begin)));
    progress(static_cast<double>(begin) / static_cast<double>(touches.size()));
  }
}

/// What the map says about the object's symmetry, and what --symmetry to give.
std::string symmetry_words(const OccupancyGrid& map, const RotationalSymmetry& measured) {
  const int n = measured.suggested;
  const std::string given =
      n == map.symmetry ? ""
      : n == 1          ? fmt::format("; --symmetry {} was given", map.symmetry)
                        : fmt::format("; --symmetry {} lets pose errors ignore such turns", n);
  if (n == 1) {
    return fmt::format("{} looks different after every turn, by {:.2f} mm or more{}", map.label,
                       measured.apart_mm[measured.nearest()], given);
  }
  return fmt::format("{} looks the same after {}, within {:.2f} mm{}", map.label,
                     n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n),
                     measured.apart_mm[n], given);
}

void build_maps(const Options& options) {
  const std::filesystem::path output = options.output;
  std::error_code ignored;
  const bool folder =
      options.output.ends_with('/') || std::filesystem::is_directory(output, ignored);
  if (!is_printable(options.label)) {
    refuse("--label", "give printable text, in UTF-8");
  }
  if (options.label == none_label) {
    refuse_flag("--label", none_label,
                "stands for objects that were never learned; choose another label");
  }
  const bool estimate = options.prior == "auto";
  const double given_prior = estimate ? 0.0 : parse_prior(options.prior);
  const std::vector<Recording> recordings = read_touch_recordings(options.recordings);
  MapOptions model = map_options(options, recordings);
  const std::vector<ObjectTouches> objects =
      group_by_label(recordings, options, model.classifier, !folder);

  std::vector<std::filesystem::path> map_paths;
  for (const ObjectTouches& object : objects) {
    map_paths.push_back(folder ? output / (object.label + ".map.h5") : output);
  }
  prepare_outputs(options, folder, map_paths, objects);

  Device device = Device::open(options.device);
  model.sensor.prior = estimate ? estimate_prior(device, objects, model) : given_prior;
  std::vector<OccupancyGrid> maps;
  std::vector<std::optional<RotationalSymmetry>> symmetries;
  {
    Progress progress("building maps");
    MapBuilder builder(device, model);
    for (const ObjectTouches& object : objects) {
      builder.clear();
      add_in_batches(builder, object.touches, [&](double fraction) {
        progress.show((static_cast<double>(maps.size()) + fraction) /
                      static_cast<double>(objects.size()));
      });
      maps.push_back(builder.build(object.label));
      maps.back().symmetry = options.symmetry;
      symmetries.push_back(measure_symmetry(maps.back()));
      if (symmetries.back()) {
        maps.back().suggested_symmetry = symmetries.back()->suggested;
      }
    }
  }

  const std::string picture = options.png.empty() ? "" : draw_maps(maps);

  // Nothing is written before all maps are built, so that a failure leaves nothing behind.
  if (!options.ros.empty()) {
    make_folder(options.ros);
  }
  if (folder) {
    make_folder(output);
  }
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const OccupancyGrid& map = maps[i];
    write_map(map_paths[i], map);
    fmt::print("{}: {} from {} touches, {} x {} cells of {} mm, prior {:.3g}\n",
               map_paths[i].string(), map.label, objects[i].touches.size(), map.nx, map.ny,
               map.cell_mm, map.prior);
    if (symmetries[i]) {
      fmt::print("{}: {}\n", map_paths[i].string(), symmetry_words(map, *symmetries[i]));
    }
  }
  if (!options.ros.empty()) {
    for (const OccupancyGrid& map : maps) {
      const std::filesystem::path yaml = ros_path(options, map.label);
      write_map_server(yaml, map);
      fmt::print("{}\n", yaml.string());
    }
  }
  if (!options.png.empty()) {
    write_file(options.png, picture);
    fmt::print("{}\n", options.png);
  }
}

}  // namespace

void add_map(CLI::App& app) {
  auto* command = app.add_subcommand(
      "map",
      "Build an object's occupancy grid from touches at known poses; the robot frame is the "
      "object's frame");
  const auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->recordings, "Recordings of touches (HDF5)")->required();
  command
      ->add_option("-o,--output", options->output,
                   "Map to write (HDF5), or FOLDER/ for one map of each object")
      ->required();
  command->add_option("--cell-mm", options->cell_mm, "Edge of a cell, mm")->capture_default_str();
  command->add_option("--psf-mm", options->psf_mm, "Standard deviation of the point spread, mm")
      ->capture_default_str();
  command->add_option("--spread-mm", options->spread_mm,
                      "Standard deviation of the inverse sensor model, mm [default: half of "
                      "--psf-mm]");
  command
      ->add_option("--peak", options->peak,
                   "Peak of the inverse sensor model, a probability below 1")
      ->capture_default_str();
  command
      ->add_option("--prior", options->prior,
                   "Probability that an unseen cell is occupied; auto: the area of all objects "
                   "divided by the area that their maps cover")
      ->capture_default_str();
  command->add_option(
      "--threshold", options->threshold,
      "Contact threshold, in the recording's pressure unit [default: 2 kPa; required for raw "
      "pressure]");
  command->add_option("--ratio", options->ratio,
                      "Threshold as a fraction of the touch's largest pressure [default: 0.3]");
  command->add_option("--frames", options->frames,
                      "Use the touches A to B - 1 of every recording, counted from 0, as A:B");
  command
      ->add_option("--symmetry", options->symmetry,
                   "n-fold rotational symmetry of the object; 1: none, 0: any rotation")
      ->check(require_whole_number)
      ->capture_default_str();
  command->add_option("--label", options->label,
                      "Label of the map [default: the object that the recording names]");
  command->add_option("--png", options->png, "Picture to write (PNG): all maps side by side");
  command->add_option("--ros", options->ros,
                      "Folder to write every map to as PGM and YAML, for ROS's map_server");
  command->add_option("--device", options->device, "Vulkan device, by index or a part of its name");
  command->callback([options] { build_maps(*options); });
}

}  // namespace palpate::cli
