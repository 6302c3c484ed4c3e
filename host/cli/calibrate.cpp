#include "cli/commands.hpp"

#include <unistd.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/calibrate_output.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/terminal.hpp"
#include "io/command_files.hpp"
#include "learning/sensor_calibration.hpp"
#include "learning/touch_sd_learning.hpp"
#include "palpate/files.hpp"
#include "recognition/map_files.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

struct Options {
  std::vector<std::string> recordings;
  std::string output;
  std::vector<std::string> maps;
  bool unposed = false;
  std::optional<double> threshold;
  std::optional<double> ratio;
  std::string layer = "auto";
  std::optional<int> levels;
  int max_maps = 5;
  Request request;  ///< bins, region and frames alone
  std::string png;
  std::string device;
};

struct Pictures {
  std::filesystem::path table;
  std::filesystem::path reliability;
};

Pictures pictures_of(const Options& options) {
  const std::filesystem::path folder = options.png;
  return {folder / "table.png", folder / "reliability.png"};
}

void check_outputs(const Options& options, const std::vector<std::filesystem::path>& maps) {
  CommandFiles files;
  for (const std::string& recording : options.recordings) {
    files.reads("RECORDING", recording);
  }
  for (const std::filesystem::path& map : maps) {
    files.reads("--maps", map);
  }
  files.writes("-o", options.output);
  const auto [table, reliability] = pictures_of(options);
  if (!options.png.empty()) {
    files.writes("--png", table);
    files.writes("--png", reliability);
  }
  files.require_distinct();
  require_writable(options.output);
  if (std::filesystem::exists(options.png)) {
    make_folder(options.png);
    require_writable(table);
    require_writable(reliability);
  }
}

/// The bins on which unknowns will be recognised; none where no flag gives them.
std::optional<RecognitionBins> bins_of(const Options& options, bool known_poses) {
  const Request& request = options.request;
  if (const auto* width = request.bins ? std::get_if<BinWidth>(&*request.bins) : nullptr) {
    refuse_flag("--bins", *width == BinWidth::fine ? "fine" : "auto",
                "give counts, as 25x25x16, or leave it out");
  }
  const bool given =
      request.bins || request.x_mm || request.y_mm || request.theta_deg || request.pivot_mm;
  if (given && !known_poses) {
    throw Error(
        Fault::input,
        "--bins, --x-mm, --y-mm, --theta-deg and --pivot-mm are for touches at known poses; "
        "leave them out: where the others lie is found on bins one element wide");
  }
  if (infers_region(request)) {
    return {};
  }
  return RecognitionBins{given_lattice(request), has_auto_pivot(request)};
}

/// @param known_poses of the touches
/// @param maps given to compare touches with; at unknown poses, where one lacks its mean level, the
/// layer auto is log_odds
SensorCalibrationOptions calibration_options(const Options& options, bool known_poses,
                                             const std::vector<OccupancyGrid>& maps,
                                             const std::string& unit) {
  SensorCalibrationOptions result{.pressure_unit = unit};
  if (options.threshold) {
    result.threshold = require_above("--threshold", *options.threshold, 0.0);
  }
  if (options.ratio) {
    result.ratio = require_above("--ratio", *options.ratio, 0.0, true);
    if (*options.ratio >= 1.0) {
      refuse_flag("--ratio", *options.ratio, "must be below 1");
    }
  }
  constexpr auto most = static_cast<int>(most_reading_levels);
  if (options.levels && (*options.levels < 2 || *options.levels > most)) {
    refuse_flag("--levels", *options.levels, "give 2 to {}", most);
  }
  if (options.layer != "auto" && options.layer != "mean_level" && options.layer != "log_odds") {
    refuse_flag("--layer", options.layer, "give auto, mean_level or log_odds");
  }
  const bool has_mean_levels =
      std::ranges::none_of(maps, [](const OccupancyGrid& map) { return map.mean_level.empty(); });
  for (const TableKind& kind : default_tables(false)) {
    const bool of_pressure = kind.layer == MapLayer::mean_level;
    const bool tried = options.layer == "auto" ? (of_pressure ? has_mean_levels : !known_poses)
                                               : of_pressure == (options.layer == "mean_level");
    if (tried) {
      result.tables.push_back(kind);
    }
  }
  if (options.levels) {
    for (TableKind& kind : result.tables) {
      kind.levels = static_cast<std::size_t>(*options.levels);
    }
  }
  if (options.max_maps < 1) {
    refuse_flag("--max-maps", options.max_maps, "give 1 or more");
  }
  result.most_maps = static_cast<std::size_t>(options.max_maps);
  result.bins = bins_of(options, known_poses);
  return result;
}

/// Throws Error where some recordings have poses and others have none.
bool all_have_poses(const Options& options, const std::vector<Recording>& recordings) {
  if (options.unposed) {
    return false;
  }
  const bool first = has_poses(recordings.front());
  for (const Recording& recording : recordings) {
    if (has_poses(recording) != first) {
      const Recording& without = first ? recording : recordings.front();
      refuse(without.path,
             "all touches are at one pose, so that their poses count as unknown, but other "
             "recordings have poses; calibrate from one kind, or give --unposed");
    }
  }
  return first;
}

std::vector<Press> presses_of(const Options& options, const std::vector<Recording>& recordings) {
  const bool posed = all_have_poses(options, recordings);
  std::vector<Press> presses;
  for (const Recording& recording : recordings) {
    if (recording.object.empty()) {
      refuse(recording.path,
             "attribute 'object' is empty; a calibration needs to know what was touched");
    }
    const auto [begin, end] = selected_touches(recording, options.request.frames);
    for (std::size_t touch = begin; touch < end; ++touch) {
      presses.push_back(posed ? posed_press(recording, touch) : single_press(recording, touch));
    }
  }
  return presses;
}

std::vector<OccupancyGrid> read_maps(const Options& options, bool known_poses,
                                     const std::vector<std::filesystem::path>& files) {
  const bool needs_mean_level =
      options.layer == "mean_level" || (options.layer == "auto" && known_poses);
  std::vector<OccupancyGrid> maps;
  for (const std::filesystem::path& file : files) {
    maps.push_back(read_map(file));
    if (needs_mean_level && maps.back().mean_level.empty()) {
      refuse(file,
             "has no mean_level; build the map with palpate map --unposed or --sensor-model, or "
             "give --layer log_odds");
    }
  }
  return maps;
}

/// Learns how far touches lie from their poses.
void add_touch_sd(const Options& options, const std::vector<Press>& presses,
                  SensorCalibration& calibration) {
  Device device = Device::open(options.device);
  Progress progress("fitting the touches' poses");
  const std::optional<DisplacementSd> sd =
      learn_touch_sd(device, presses, calibration.sensor, calibration.maps,
                     [&](double fraction) { progress.show(fraction); });
  calibration.touch_sd_fitted = sd.has_value();
  calibration.sensor.touch_sd = sd.value_or(DisplacementSd{});
}

void calibrate(const Options& options) {
  std::vector<std::filesystem::path> maps_read;
  for (const std::string& argument : options.maps) {
    const std::vector<std::filesystem::path> files = map_files(argument);
    maps_read.insert(maps_read.end(), files.begin(), files.end());
  }
  check_outputs(options, maps_read);
  const std::vector<Recording> recordings = read_touch_recordings(options.recordings);
  const std::vector<Press> presses = presses_of(options, recordings);
  const bool known_poses = presses.front().T_object_robot.has_value();
  const std::vector<OccupancyGrid> maps = read_maps(options, known_poses, maps_read);
  const SensorCalibrationOptions how =
      calibration_options(options, known_poses, maps, recordings.front().pressure_unit);

  SensorCalibration calibration;
  {
    Progress progress("calibrating");
    calibration =
        calibrate_sensor(presses, maps, how, [&](double fraction) { progress.show(fraction); });
  }
  if (known_poses) {
    add_touch_sd(options, presses, calibration);
  }
  const Pictures pictures = pictures_of(options);
  std::string table;
  std::string reliability;
  if (!options.png.empty()) {
    table = draw_table(calibration.sensor);
    reliability = calibration.before ? draw_reliability(reliability_of(calibration)) : "";
    make_folder(options.png);
  }
  write_sensor_model(options.output, calibration.sensor);
  fmt::print("{}", calibration_text(calibration, presses.size(), terminal_columns(STDOUT_FILENO)));
  std::ranges::for_each(calibration.warnings, tell_on_stderr);
  fmt::print("{}\n", options.output);
  if (!options.png.empty()) {
    write_file(pictures.table, table);
    fmt::print("{}\n", pictures.table.string());
    if (!reliability.empty()) {
      write_file(pictures.reliability, reliability);
      fmt::print("{}\n", pictures.reliability.string());
    }
  }
}

}  // namespace

void add_calibrate(CLI::App& app) {
  auto* command = app.add_subcommand(
      "calibrate",
      "Learn a sensor model from touches of known objects: contact threshold, noise, what the "
      "elements read on and beside an object, and how sure to be. map, recognize, live and plan "
      "take it as --sensor-model");
  const auto options = std::make_shared<Options>();
  command
      ->add_option("RECORDING", options->recordings,
                   "Recordings (HDF5) that name their object, best with 15 touches or more of each "
                   "object. Where all touches of a recording are at one pose, their poses count as "
                   "unknown")
      ->required();
  command->add_option("-o,--output", options->output, "Sensor model to write (YAML)")->required();
  command->add_option("--maps", options->maps,
                      "Maps, or folders of maps, of the objects, built from other touches than "
                      "these [default: maps of the touches themselves, each compared with maps "
                      "that were built without it]");
  command->add_flag("--unposed", options->unposed,
                    "The sensor's poses are unknown: find where each touch lies on the others. For "
                    "arrays so large that a touch shows much of the object");
  command->add_option("--threshold", options->threshold,
                      "Contact threshold, in the recordings' pressure unit [default: learned]");
  command->add_option("--ratio", options->ratio,
                      "Threshold as a fraction of the touch's largest pressure [default: learned]");
  command
      ->add_option("--layer", options->layer,
                   "What of a map readings are compared with: mean_level, the mean pressure; "
                   "log_odds, of occupancy; or auto: mean_level at known poses; at unknown poses "
                   "both are tried, and log_odds is kept unless mean_level is clearly better about "
                   "presses that it has not seen")
      ->capture_default_str();
  command
      ->add_option("--levels", options->levels,
                   "Levels of readings that are told apart, No Contact included [default: 7 over "
                   "the mean pressure, 2 over log odds]")
      ->check(require_whole_number);
  command
      ->add_option("--max-maps", options->max_maps,
                   "Most maps of an object that a touch is compared with to learn how sure to be: "
                   "about as many as you will recognize with. More take longer")
      ->check(require_whole_number)
      ->capture_default_str();
  add_bins_flag(
      *command, options->request,
      "Pose bins that recognize will be given, as 25x25x16; for touches at known poses. Unknowns "
      "lie between bins, and fit the worse the wider bins are: calibrate learns by how much "
      "[default: bins half the elements' spacing and 5 degrees wide where the touches are; "
      "25x25x16 where a range or X,Y is given]");
  add_range_flag(*command, "--x-mm", options->request.x_mm,
                 "Range of these bins, mm, as recognize will be given it [default: -10:10 "
                 "beside --bins]");
  add_range_flag(*command, "--y-mm", options->request.y_mm, "The same along y, mm");
  add_range_flag(*command, "--theta-deg", options->request.theta_deg,
                 "The same of theta, degrees [default: 0:360]");
  add_pivot_flag(*command, options->request,
                 "Pivot of these bins, mm, as recognize will be given it: X,Y or auto "
                 "[default: 0,0 beside --bins]");
  add_frames_flag(*command, options->request.frames,
                  "Use the touches A to B - 1 of every recording, counted from 0, as A:B");
  command->add_option("--png", options->png,
                      "Folder for pictures: table.png, what elements read, and reliability.png, "
                      "accuracy over confidence before and after");
  command->add_option("--device", options->device,
                      "Vulkan device, by index or a part of its name; touches at unknown poses use "
                      "none");
  command->callback([options] { calibrate(*options); });
}

}  // namespace palpate::cli
