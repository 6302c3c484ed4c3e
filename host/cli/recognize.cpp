#include "commands.hpp"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include <fmt/format.h>

#include "figures.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "progress.hpp"
#include "recogniser.hpp"
#include "recognition_record.hpp"
#include "recognition_task.hpp"

namespace palpate::cli {

namespace {

std::string png_name(const Unknown& unknown) {
  const std::string stem = std::filesystem::path(unknown.recording->path).stem().string();
  return unknown.frame ? fmt::format("{}.{}.png", stem, *unknown.frame) : stem + ".png";
}

/// Throws Error where a result could not be kept: before the work, not after.
void check_outputs(const RecognizeOptions& options, const RecognitionTask& task) {
  if (!options.posterior.empty()) {
    if (task.unknowns.size() != 1) {
      throw Error(Fault::input, fmt::format("--posterior {}: holds one unknown, not {}; select one "
                                            "recording or frame",
                                            options.posterior, task.unknowns.size()));
    }
  }
  std::vector<std::pair<std::string, std::filesystem::path>> outputs;
  if (!options.posterior.empty()) {
    outputs.emplace_back("--posterior", options.posterior);
  }
  if (!options.json.empty() && options.json != "-") {
    outputs.emplace_back("--json", options.json);
  }
  std::vector<std::filesystem::path> inputs(options.recordings.begin(), options.recordings.end());
  inputs.insert(inputs.end(), task.map_paths.begin(), task.map_paths.end());
  if (!options.scene.empty()) {
    inputs.emplace_back(options.scene);
  }
  require_distinct(outputs, inputs);
  for (const auto& output : outputs) {
    require_writable(output.second);
  }
  if (!options.png.empty()) {
    std::set<std::string> names;
    for (const Unknown& unknown : task.unknowns) {
      if (!names.insert(png_name(unknown)).second) {
        throw Error(Fault::input,
                    fmt::format("{}: another recording has the same name, and so would its "
                                "picture; rename one",
                                unknown.recording->path));
      }
    }
  }
}

RecognitionRecord recognize_one(const Unknown& unknown, const RecognitionTask& task, bool trace,
                                Recogniser& recogniser,
                                const std::function<void(double)>& progress) {
  RecognitionRecord record{.recording = unknown.recording->path,
                           .frame = unknown.frame,
                           .touches = unknown.touches.size(),
                           .true_label = true_label(*unknown.recording),
                           .trace = {}};
  const auto look = [&] {
    const Estimate estimate = recogniser.estimate();
    record.trace.push_back(judge(estimate, recogniser.refine(estimate.mode), unknown, task));
    record.trace.back().effective_sample_size = recogniser.effective_sample_size();
  };
  const auto start = std::chrono::steady_clock::now();
  recogniser.reset();
  if (trace) {
    const auto touches = static_cast<double>(unknown.touches.size());
    for (const Touch& touch : unknown.touches) {
      const auto done = static_cast<double>(record.trace.size());
      recogniser.update(std::span(&touch, 1),
                        [&](double fraction) { progress((done + fraction) / touches); });
      look();
    }
  } else {
    recogniser.update(unknown.touches, progress);
    look();
  }
  record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return record;
}

/// Edge at which an element is drawn: as a DigiTacts's, or where others lie closer, as their pitch
/// allows.
double element_edge_mm(const Touch& touch) {
  const glm::dvec2& first = touch.elements_mm.front();
  double nearest = 2.0;
  for (const glm::dvec2& other : touch.elements_mm.subspan(1)) {
    nearest = std::min(nearest, std::hypot(other.x - first.x, other.y - first.y));
  }
  return 0.9 * nearest;
}

std::string draw_sheet(const RecognitionRecord& record, const Unknown& unknown,
                       const RecognitionTask& task, const Recogniser& recogniser) {
  const Step& last = record.last();
  RecognitionSheet sheet;
  sheet.title = name_of(record);
  sheet.map = task.hypotheses[last.mode.object].map;
  sheet.element_mm = element_edge_mm(unknown.touches.front());
  sheet.T_object_robot = last.mode.T_object_robot;
  sheet.none = task.labels[last.best] == none_label;
  sheet.true_object = record.true_label;
  if (last.error_mm) {
    sheet.truth = unknown.recording->truth->T_object_robot;
    sheet.error_mm = last.error_mm;
  }
  sheet.lattice = task.histogram.lattice;
  sheet.belief_xy = recogniser.belief_xy(last.mode.object);
  sheet.labels = task.labels;
  for (const Touch& touch : unknown.touches) {
    auto& footprint = sheet.footprints_mm.emplace_back();
    for (const glm::dvec2& element : touch.elements_mm) {
      footprint.push_back(touch.T_robot_sensor * element);
    }
  }
  for (const Step& step : record.trace) {
    sheet.identity.push_back(step.identity);
  }
  return draw_recognition(sheet);
}

Posterior export_posterior(const RecognitionTask& task, const PoseHistogram& histogram) {
  Posterior posterior{.objects = {}, .lattice = histogram.lattice(), .log_likelihood = {}};
  for (std::size_t i = 0; i < task.hypotheses.size(); ++i) {
    posterior.objects.push_back(task.hypotheses[i].map.label);
    const std::vector<double> logs = histogram.log_likelihood(static_cast<int>(i));
    posterior.log_likelihood.insert(posterior.log_likelihood.end(), logs.begin(), logs.end());
  }
  return posterior;
}

/// Counts for --bins auto: what the maps are worth and the device holds.
PoseLattice choose_bins(const RecognitionTask& task, const Device& device) {
  const HistogramOptions& histogram = task.histogram;
  const std::int64_t most = most_bins_on(device, histogram.still_array);
  const BalancedLattice chosen = balanced_lattice(histogram.lattice, task.hypotheses, most);
  if (chosen.bounded) {
    fmt::print(stderr,
               "palpate: --bins auto: steps of {:.2f} mm, coarser than the maps are worth, to keep "
               "to {} bins in all; narrow the region, or give --bins\n",
               chosen.step_mm, most);
  }
  return chosen.lattice;
}

void recognize(const RecognizeOptions& options) {
  RecognitionTask task = prepare(options);
  check_outputs(options, task);
  Device device = Device::open(task.device);
  if (task.auto_bins) {
    task.histogram.lattice = choose_bins(task, device);
    if (task.particles) {  // of which pictures count how many lie in each bin
      task.particles->region = task.histogram.lattice;
    }
  }
  const std::unique_ptr<Recogniser> recogniser = make_recogniser(device, task);
  if (!options.png.empty()) {
    make_folder(options.png);
  }

  // The sheet shows the identity over the touches, so it needs the trace too.
  const bool trace = options.trace || !options.png.empty();
  std::vector<RecognitionRecord> records;
  auto json = nlohmann::ordered_json::array();
  {
    Progress progress("recognising");
    for (const Unknown& unknown : task.unknowns) {
      const auto show = [&](double fraction) {
        progress.show((static_cast<double>(records.size()) + fraction) /
                      static_cast<double>(task.unknowns.size()));
      };
      records.push_back(recognize_one(unknown, task, trace, *recogniser, show));
      show(0.0);
      json.push_back(to_json(records.back(), task, device.name(), options.trace));
      if (!options.png.empty()) {
        write_file(std::filesystem::path(options.png) / png_name(unknown),
                   draw_sheet(records.back(), unknown, task, *recogniser));
      }
      if (!options.posterior.empty()) {
        write_posterior(options.posterior, export_posterior(task, *recogniser->histogram()));
      }
    }
  }

  // The path of a recording need not be UTF-8, as JSON must.
  const std::string json_text =
      json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  if (options.json == "-") {
    fmt::print("{}", json_text);
  } else {
    fmt::print("{}: {} maps, {}\n\n", device.name(), task.hypotheses.size(),
               recogniser->description());
    if (options.trace) {
      for (const RecognitionRecord& record : records) {
        print_trace(record, task);
      }
      fmt::print("\n");
    }
    print_table(records, task);
    if (!options.json.empty()) {
      write_file(options.json, json_text);
    }
  }
}

}  // namespace

void add_recognize(CLI::App& app) {
  auto* command = app.add_subcommand("recognize",
                                     "Recognise and locate the object of each recording among "
                                     "known maps. Poses are T_object_robot, "
                                     "p_object = R(theta) p_robot + (x, y)");
  const auto options = std::make_shared<RecognizeOptions>();
  command->add_option("RECORDING", options->recordings, "Recordings of unknown objects (HDF5)")
      ->required();
  command->add_option("--maps", options->maps, "Maps of the known objects, or folders of maps");
  command->add_option("--scene", options->scene,
                      "Scene file (YAML) with any of: array, threshold, ratio, gamma, prior, "
                      "none, objects, region, bins, filter, device; a flag overrides its key");
  command->add_option("--bins", options->bins,
                      "Pose bins per object along x, y and theta [default: 25x25x16]; auto: as "
                      "many as the maps' cells are worth and the device holds");
  command->add_option("--x-mm", options->x_mm,
                      "Range of x, mm, as --x-mm=-10:10 [default: -10:10]");
  command->add_option("--y-mm", options->y_mm,
                      "Range of y, mm, as --y-mm=-10:10 [default: -10:10]");
  command->add_option("--theta-deg", options->theta_deg,
                      "Range of theta, degrees [default: 0:360]; a fixed angle, 30:30, is one bin");
  command->add_option("--pivot-mm", options->pivot_mm,
                      "Point X,Y in the robot frame, mm, that theta turns about and whose place in "
                      "the object frame x and y are [default: 0,0]");
  command->add_option("--prior", options->prior,
                      "Probability that an unseen cell is occupied [default: the maps' own]");
  command->add_option("--gamma", options->gamma,
                      "Rate at which a contact reading is random [default: 0.1]");
  command->add_option("--none", options->none,
                      "Prior weight of \"(none)\", an object that was never learned, where each "
                      "map's is 1 or its scene's: with 5 maps, 5 makes it as likely as not; its "
                      "likelihood is that of a map of nothing but the prior [default: left out]");
  command->add_option(
      "--threshold", options->threshold,
      "Contact threshold, in the recording's pressure unit [default: 2 kPa; must be "
      "given for raw pressure]");
  command->add_option("--ratio", options->ratio,
                      "Contact threshold as a part of the touch's largest pressure [default: 0.3]");
  command->add_option("--frames", options->frames,
                      "Use the touches A:B, from A up to before B, of every recording");
  command->add_option("--touches", options->touches, "Use the first N touches [default: all]")
      ->check(require_whole_number);
  command->add_flag("--each-frame", options->each_frame,
                    "Take every touch for an unknown object of its own");
  command->add_option("--filter", options->filter,
                      "auto, histogram or particles; auto is histogram [default: auto]");
  command
      ->add_option("--particles", options->particles,
                   "Particles over all objects together, up to 1,000,000 [default: 10000]")
      ->check(require_whole_number);
  command->add_option("--resampling", options->resampling,
                      "multinomial or systematic [default: multinomial]");
  command->add_flag("--augmented", options->augmented,
                    "Augmented MCL: add random particles where the touches fit worse than before");
  command->add_option("--seed", options->seed, "Seed of the particles' random numbers [default: 0]")
      ->check(require_whole_number);
  command->add_flag("--trace", options->trace, "Show the estimate after every touch");
  command->add_option("--json", options->json, "Write the records as JSON; - is standard output");
  command->add_option("--posterior", options->posterior,
                      "Write the log-likelihood of every bin of one recording (HDF5)");
  command->add_option("--png", options->png,
                      "Folder for a sheet per unknown: footprints, belief, identities");
  command
      ->add_option("--memory-mib", options->memory_mib,
                   "Most memory of the device to take, MiB [default: all of it]; less costs time")
      ->check(require_whole_number);
  command->add_option("--device", options->device, "Vulkan device, by index or a part of its name");
  command->callback([options] { recognize(*options); });
}

}  // namespace palpate::cli
