#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "learning/setup_check.hpp"
#include "model/element_spacing.hpp"
#include "model/option_words.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

struct CheckArguments {
  std::vector<std::string> recordings;
  Request request;  ///< threshold, ratio and device
  double cell_mm = 0.5;
  std::optional<double> spread_mm;
  std::string json;
  std::string write_array;
};

void check(const CheckArguments& options) {
  CommandFiles()
      .reads("RECORDING", options.recordings)
      .writes("--json", options.json, CommandFiles::Dash::stream)
      .writes("--write-array", options.write_array)
      .prepare();
  const std::vector<Recording> recordings = read_touch_recordings(options.recordings);
  const Recording& first = recordings.front();
  MapOptions maps{.cell_mm = require_above("--cell-mm", options.cell_mm, 0.0)};
  maps.sensor.spread_mm = options.spread_mm ? require_above("--spread-mm", *options.spread_mm, 0.0)
                                            : usual_spread_mm(recordings);
  maps.classifier = make_classifier(first.pressure_unit, first.path, options.request.threshold,
                                    options.request.ratio);
  Device device = Device::open(options.request.device);
  const SetupCheck found = with_progress("trying set-ups", [&](const auto& show) {
    return check_setup(device, recordings, maps, show);
  });
  if (!options.write_array.empty()) {
    write_file(options.write_array, array_table(found.elements_mm));
  }
  auto json = nlohmann::ordered_json::array();
  std::string text;
  bool moves_elements = false;
  for (const SetupFinding& finding : found.findings) {
    json.push_back(to_json(finding));
    text += fmt::format("{} ({:.0f} nats)\n", in_flags(finding.words), finding.nats);
    moves_elements = moves_elements || finding.what == "array_offset" || finding.what == "pitch";
  }
  if (options.write_array.empty() && moves_elements) {
    text += "palpate check --write-array FILE writes the corrected array\n";
  }
  for (const std::string& remark : found.remarks) {
    text += in_flags(remark) + "\n";
  }
  if (found.findings.empty()) {
    text += fmt::format("{} touches: nothing is wrong with the set-up\n", found.touches);
  }
  give_result(options.json, text_of(json, 2), text);
}

}  // namespace

void add_check(CLI::App& app) {
  const auto [command, options] = add_command<CheckArguments>(
      app, "check",
      "Ask touches at known poses which set-up explains them best: the order of the elements, "
      "where the array sits in the tool, its pitch, units of the poses, dead elements, and touches "
      "that contradict the others. Each finding comes with its evidence, in nats, and what mends "
      "it",
      check);
  add_required(*command, "RECORDING", options->recordings,
               "Recordings of touches (HDF5), of one array and of objects that stay in place: "
               "some 60 of each, at several angles of the sensor, so that they overlap");
  command->add_option("--json", options->json, "File for the findings as JSON, or -");
  command->add_option("--write-array", options->write_array,
                      "File for the array as the findings correct it (CSV: x, y in mm), for "
                      "--array of palpate import");
  add_option_flag(*command, options->request, "threshold",
                  "Contact threshold, in the recording's pressure unit [default: 2 kPa; required "
                  "for raw pressure]");
  add_option_flag(*command, options->request, "ratio",
                  "Threshold as a fraction of the touch's largest pressure [default: 0.3]");
  add_with_default(*command, "--cell-mm", options->cell_mm, "Edge of a map's cell, mm");
  command->add_option("--spread-mm", options->spread_mm,
                      "Standard deviation of the inverse sensor model, mm [default: a quarter of "
                      "the distance of neighbouring elements; 0.5 for DigiTacts and one element]");
  add_option_flag(*command, options->request, "device",
                  "Vulkan device, by index or a part of its name");
}

}  // namespace palpate::cli
