#include "cli/commands.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/calibrate_output.hpp"
#include "cli/command_files.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "learning/calibration_task.hpp"
#include "palpate/files.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

struct CalibrateArguments {
  std::vector<std::string> recordings;
  std::string output;
  std::vector<std::string> maps;
  CalibrationRequest request;
  Request recognition;  ///< bins, region and frames alone
  std::string write_array;
  std::string device;
};

void check_outputs(const CalibrateArguments& options,
                   const std::vector<std::filesystem::path>& maps) {
  CommandFiles files;
  for (const std::string& recording : options.recordings) {
    files.reads("RECORDING", recording);
  }
  for (const std::filesystem::path& map : maps) {
    files.reads("--maps", map);
  }
  files.writes("-o", options.output);
  files.writes("--write-array", options.write_array);
  files.prepare();
}

/// The array of all recordings. Throws Error where it changes.
std::vector<glm::dvec2> common_array(const std::vector<Recording>& recordings) {
  const std::vector<glm::dvec2>& elements_mm = recordings.front().elements_mm;
  for (const Recording& recording : recordings) {
    if (recording.elements_mm != elements_mm || elements_mm.size() != recording.elements()) {
      refuse(recording.path,
             "its array is not that of all touches; leave --write-array out, or calibrate from "
             "recordings of one array");
    }
  }
  return elements_mm;
}

void calibrate(const CalibrateArguments& options) {
  std::vector<std::filesystem::path> maps_read;
  for (const std::string& argument : options.maps) {
    const std::vector<std::filesystem::path> files = map_files(argument);
    maps_read.insert(maps_read.end(), files.begin(), files.end());
  }
  check_outputs(options, maps_read);
  const std::vector<Recording> recordings = read_touch_recordings(options.recordings);
  std::vector<GivenMap> maps;
  for (const std::filesystem::path& file : maps_read) {
    maps.push_back({file.string(), {.map = read_map(file)}});
  }
  const std::optional<Bins>& bins = options.recognition.bins;
  if (const auto* width = bins ? std::get_if<BinWidth>(&*bins) : nullptr) {
    refuse_flag("--bins", *width == BinWidth::fine ? "fine" : "auto",
                "give counts, as 25x25x16, or leave it out");
  }
  const CalibrationTask task =
      calibration_task(options.request, options.recognition, recordings, maps);

  std::vector<glm::dvec2> array_mm;
  if (!options.write_array.empty()) {
    if (!task.known_poses() ||
        std::ranges::none_of(maps, [](const GivenMap& map) { return map.hypothesis.map.drawn; })) {
      refuse_flag("--write-array", options.write_array,
                  "touches at known poses on drawn maps tell where the array sits; give such maps "
                  "by --maps, or leave it out");
    }
    array_mm = common_array(recordings);
  }

  SensorCalibration calibration;
  {
    Progress progress("calibrating");
    calibration = calibrate_sensor(task.presses, task.maps, task.options,
                                   [&](double fraction) { progress.show(fraction); });
  }
  write_sensor_model(options.output, calibration.sensor);
  if (!options.write_array.empty()) {
    for (glm::dvec2& p : array_mm) {
      p = calibration.array_offset ? *calibration.array_offset->array_offset * p : p;
    }
    write_file(options.write_array, array_table(array_mm));
  }
  fmt::print("{}", calibration_text(calibration, task.presses.size()));
  std::ranges::for_each(calibration.warnings, tell_on_stderr);
  if (calibration.array_offset && options.write_array.empty()) {
    fmt::print("palpate calibrate --write-array FILE writes the corrected array\n");
  }
  fmt::print("{}\n", options.output);
}

}  // namespace

void add_calibrate(CLI::App& app) {
  auto* command = app.add_subcommand(
      "calibrate",
      "Learn a sensor model from touches of known objects: contact threshold, noise, what the "
      "elements read on and beside an object, and how sure to be. map, recognize, live and plan "
      "take it as --sensor-model");
  const auto options = std::make_shared<CalibrateArguments>();
  command
      ->add_option("RECORDING", options->recordings,
                   "Recordings (HDF5) that name their object, best with 15 touches or more of each "
                   "object. Where all touches of a recording are at one pose, their poses count as "
                   "unknown")
      ->required();
  command->add_option("-o,--output", options->output, "Sensor model to write (YAML)")->required();
  command->add_option("--maps", options->maps,
                      "Maps, or folders of maps, of the objects, from drawings, which also tell "
                      "where the array sits in the tool, or built from other touches than "
                      "these; the objects lie where the recordings' truth says, or where they were "
                      "learned [default: maps of the touches themselves, each compared with maps "
                      "that were built without it]");
  command->add_flag("--unposed", options->request.unposed,
                    "The sensor's poses are unknown: find where each touch lies on the others. For "
                    "arrays so large that a touch shows much of the object");
  command->add_option("--group", options->request.group,
                      "How touches are grouped, such as by the person or the day that made them. A"
                      " group is left out as a whole where it is learned how sure to be: "
                      "recording, a group a file; label, a group for each GROUP of objects named "
                      "LABEL@GROUP");
  command->add_option("--threshold", options->request.threshold,
                      "Contact threshold, in the recordings' pressure unit [default: learned]");
  command->add_option("--ratio", options->request.ratio,
                      "Threshold as a fraction of the touch's largest pressure [default: learned]");
  command
      ->add_option("--layer", options->request.layer,
                   "What of a map readings are compared with: mean_level, the mean pressure; "
                   "log_odds, of occupancy; or auto: mean_level at known poses; at unknown poses "
                   "both are tried, and log_odds is kept unless mean_level is clearly better about "
                   "presses that it has not seen")
      ->capture_default_str();
  command
      ->add_option("--levels", options->request.levels,
                   "Levels of readings that are told apart, No Contact included [default: 7 over "
                   "the mean pressure, 2 over log odds]")
      ->check(require_whole_number);
  command
      ->add_option("--max-maps", options->request.max_maps,
                   "Most maps of an object that a touch is compared with to learn how sure to be: "
                   "about as many as you will recognise with. More maps take longer")
      ->check(require_whole_number)
      ->capture_default_str();
  add_option_flag(
      *command, options->recognition, "bins",
      "Pose bins that recognize will be given, as 25x25x16; for touches at known poses. Unknowns "
      "lie between bins, and fit the worse the wider bins are: calibrate learns by how much "
      "[default: bins half the elements' spacing and 5 degrees wide where the touches are; "
      "25x25x16 where a range or X,Y is given]");
  add_option_flag(*command, options->recognition, "x-mm",
                  "Range of these bins, mm, as recognize will be given it [default: -10:10 "
                  "beside --bins]");
  add_option_flag(*command, options->recognition, "y-mm", "The same along y, mm");
  add_option_flag(*command, options->recognition, "theta-deg",
                  "The same of theta, degrees [default: 0:360]");
  add_option_flag(*command, options->recognition, "pivot-mm",
                  "Pivot of these bins, mm, as recognize will be given it: X,Y or auto "
                  "[default: 0,0 beside --bins]");
  add_option_flag(*command, options->recognition, "frames");
  command->add_option("--write-array", options->write_array,
                      "File for the array, CSV of x and y in mm, where drawn maps say that it sits "
                      "in the tool, for --array of palpate import");
  command->add_option("--device", options->device,
                      "Vulkan device, as for the other commands; learning uses none");
  command->callback([options] { calibrate(*options); });
}

}  // namespace palpate::cli
