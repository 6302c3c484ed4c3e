#include "cli/commands.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/text_table.hpp"
#include "learning/sensor_calibration.hpp"
#include "learning/table_learning.hpp"
#include "model/option_words.hpp"
#include "palpate/files.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

std::string short_number(double value) { return fmt::format("{:.3g}", value); }

std::string values_table(const SensorCalibration& calibration) {
  const LearnedSensor& sensor = calibration.sensor;
  const LearnedSensor initial;
  const bool raw = sensor.pressure_unit == "raw";
  const std::string& unit = sensor.pressure_unit;
  TextTable table({{"", false}, {"default", true}, {"learned", true}});
  const auto add = [&](const std::string& name, const std::string& usual, double learned) {
    table.add({name, usual, short_number(learned)});
  };
  add("noise floor, " + unit, "", sensor.noise);
  add("contact threshold, " + unit, raw ? "" : short_number(initial.classifier.threshold),
      sensor.classifier.threshold);
  add("ratio", short_number(initial.classifier.ratio), sensor.classifier.ratio);
  add("spread of maps, mm", short_number(initial.spread_mm), sensor.spread_mm);
  add("gamma of Eq. 7", short_number(initial.gamma), sensor.gamma);
  add("prior", "", sensor.prior);
  table.add({"levels of readings", "2", fmt::format("{}", sensor.table->levels())});
  add("temperature", "1", sensor.temperature);
  if (calibration.groups) {
    add("more for every further touch", "0", sensor.temperature_growth);
  }
  if (sensor.features) {
    add("weight of area, force and peak", "0", sensor.features->weight);
  }
  if (sensor.fit_scale) {
    table.add({"fit of learned objects, z", "0 +- 1",
               fmt::format("{:.2g} +- {:.2g}", sensor.fit_scale->mean, sensor.fit_scale->sd)});
    if (const auto& learned = sensor.fit_scale->stranger_single_touch) {
      table.add({"of one touch of strangers, on it", "0 +- 1",
                 fmt::format("{:.2g} +- {:.2g}", learned->mean, learned->sd)});
    }
    if (const auto& learned = sensor.fit_scale->stranger_sd) {
      table.add({"of strangers, for every further touch",
                 fmt::format("+- {:.2g} more", usual_stranger_sd),
                 fmt::format("+- {:.2g} more", *learned)});
    }
  }
  return table.text();
}

std::string scores_table(const std::string& title, const char* records,
                         const ComparedScores& scores) {
  const auto& [before, learned, after] = scores;
  TextTable table({{title, false}, {"Eq. 7", true}, {"table", true}, {"table, tempered", true}});
  table.add({records, fmt::format("{}", before.records), fmt::format("{}", learned.records),
             fmt::format("{}", after.records)});
  add_score_rows(table, {&before, &learned, &after});
  return "\n" + table.text();
}

std::string kind_name(const TableKind& kind) {
  return fmt::format("{} levels over {}", kind.levels,
                     kind.layer == MapLayer::log_odds ? "log odds" : "the mean pressure");
}

/// What was learned beside the defaults, and how good it is on touches that it has not seen.
std::string calibration_text(const SensorCalibration& calibration, std::size_t touches) {
  std::string text = fmt::format("{} touches, {}\n\n", touches,
                                 count_of(calibration.objects, "object", "objects"));
  text += values_table(calibration);
  if (calibration.touches) {
    text += scores_table("cross-validation", "touches", *calibration.touches);
  }
  if (calibration.groups) {
    text += scores_table(fmt::format("{} touches together", presses_in_group), "unknowns",
                         *calibration.groups);
  }
  if (calibration.tried.size() > 1) {
    text += "tables tried, with their log-loss:";
    for (const TriedTable& table : calibration.tried) {
      text += fmt::format("{} {}, {:.3f}", &table == calibration.tried.data() ? "" : ";",
                          kind_name(table.kind), table.log_loss);
    }
    text += fmt::format("; kept: {}\n", kind_name({calibration.sensor.table->layer.of,
                                                   calibration.sensor.table->levels()}));
  }
  if (const std::string words = unlearned_strangers(calibration.sensor); !words.empty()) {
    text += words + "\n";
  }
  if (calibration.array_offset) {
    text += in_flags(calibration.array_offset->words) +
            fmt::format(" ({:.0f} nats)\n", calibration.array_offset->nats);
  }
  return text;
}

struct CalibrateArguments {
  std::vector<std::string> recordings;
  std::string output;
  std::vector<std::string> maps;
  CalibrationRequest request;
  Request recognition;  ///< classifier, bins, region, frames and device alone
  std::string write_array;
};

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
  std::vector<std::string> maps_read;
  for (const std::string& argument : options.maps) {
    std::ranges::copy(map_files(argument), std::back_inserter(maps_read));
  }
  CommandFiles()
      .reads("RECORDING", options.recordings)
      .reads("--maps", maps_read)
      .writes("-o", options.output)
      .writes("--write-array", options.write_array)
      .prepare();
  const std::vector<Recording> recordings = read_touch_recordings(options.recordings);
  std::vector<GivenMap> maps;
  for (const std::string& file : maps_read) {
    maps.push_back({file, {.map = read_map(file)}});
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

  const SensorCalibration calibration = with_progress("calibrating", [&](const auto& show) {
    return calibrate_sensor(task.presses, task.maps, task.options, show);
  });
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
  const auto [command, options] = add_command<CalibrateArguments>(
      app, "calibrate",
      "Learn a sensor model from touches of known objects: contact threshold, noise, what the "
      "elements read on and beside an object, and how sure to be. map, recognize, live, batch and "
      "plan take it as --sensor-model",
      calibrate);
  add_required(
      *command, "RECORDING", options->recordings,
      "Recordings (HDF5) that name their object, best with 15 touches or more of each object. "
      "Where all touches of a recording are at one pose, their poses count as unknown");
  add_required(*command, "-o,--output", options->output, "Sensor model to write (YAML)");
  command->add_option(
      "--maps", options->maps,
      "Maps, or folders of maps, of the objects, from drawings, which also tell where the array "
      "sits in the tool, or built from other touches than these; the objects lie where the "
      "recordings' truth says, or where they were learned [default: maps of the touches "
      "themselves, each compared with maps that were built without it]");
  command->add_flag("--unposed", options->request.unposed,
                    "The sensor's poses are unknown: find where each touch lies on the others. For "
                    "arrays so large that a touch shows much of the object");
  command->add_option("--group", options->request.group,
                      "How touches are grouped, such as by the person or the day that made them. A "
                      "group is left out as a whole where it is learned how sure to be: recording, "
                      "a group a file; label, a group for each GROUP of objects named LABEL@GROUP");
  add_option_flag(*command, options->recognition, "threshold",
                  "Contact threshold, in the recordings' pressure unit [default: learned]");
  add_option_flag(*command, options->recognition, "ratio",
                  "Threshold as a fraction of the touch's largest pressure [default: learned]");
  add_with_default(
      *command, "--layer", options->request.layer,
      "What of a map readings are compared with: mean_level, the mean pressure; log_odds, of "
      "occupancy; or auto: mean_level at known poses; at unknown poses both are tried, and "
      "log_odds is kept unless mean_level is clearly better about presses that it has not seen");
  command
      ->add_option("--levels", options->request.levels,
                   "Levels of readings that are told apart, No Contact included [default: 7 over "
                   "the mean pressure, 2 over log odds]")
      ->check(require_whole_number);
  add_with_default(*command, "--max-maps", options->request.max_maps,
                   "Most maps of an object that a touch is compared with to learn how sure to be: "
                   "about as many as you will recognise with. More maps take longer")
      ->check(require_whole_number);
  add_option_flag(*command, options->recognition, "bins",
                  "Pose bins that recognize will be given, as 25x25x16; for touches at known "
                  "poses. Unknowns lie between bins, and fit the worse the wider bins are: "
                  "calibrate learns by how much [default: bins half the elements' spacing and 5 "
                  "degrees wide where the touches are; 25x25x16 where a range or X,Y is given]");
  add_option_flag(
      *command, options->recognition, "x-mm",
      "Range of these bins, mm, as recognize will be given it [default: -10:10 beside --bins]");
  add_option_flag(*command, options->recognition, "y-mm", "The same along y, mm");
  add_option_flag(*command, options->recognition, "theta-deg",
                  "The same of theta, degrees [default: 0:360]");
  add_option_flag(*command, options->recognition, "pivot-mm",
                  "Pivot of these bins, mm, as recognize will be given it: X,Y or auto [default: "
                  "0,0 beside --bins]");
  add_option_flag(*command, options->recognition, "frames");
  command->add_option("--write-array", options->write_array,
                      "File for the array, CSV of x and y in mm, where drawn maps say that it sits "
                      "in the tool, for --array of palpate import");
  add_option_flag(*command, options->recognition, "device",
                  "Vulkan device, as for the other commands; learning uses none");
}

}  // namespace palpate::cli
