#include "cli/recognition_flags.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "model/option_words.hpp"
#include "recognition/filter_choice.hpp"

namespace palpate::cli {

namespace {

void add_filter_flags(CLI::App& command, Request& request) {
  add_text_flag(
      command, "--filter", request.filter,
      fmt::format(
          "histogram: evaluates every pose bin; bounded: the same bins, but evaluates only those "
          "that matter and proves how little the others can; particles: the paper's particle "
          "filter; auto: bounded for more than {} bins of all objects together, else histogram, "
          "which it also takes for --posterior [default: auto]",
          most_histogram_bins));
  command.add_option(
      "--tolerance", request.tolerance,
      "With --filter bounded: largest share of the belief that may be left "
      "unproven; the search goes on until it is reached. Rounding, which counts as "
      "unproven, may exceed a tolerance below about 1e-8 [default: 1e-6, and 1e-4 for "
      "what a trace or a picture of 'recognize' shows before the last touch; a search by a "
      "learned sensor ends sooner where it meets nothing but poor fits]");
  command.add_option("--budget-ms", request.budget_ms,
                     "With --filter bounded: milliseconds after which each estimate's search ends "
                     "and reports what it has proven by then. With --slip-sd-* each touch also "
                     "takes a time of its own, which grows with the bins [default: none]");
  command.add_option("--evidence-nats", request.evidence_nats,
                     "With --filter bounded: also bounds the log evidence of every object, however "
                     "unlikely, within this many nats [default: only the tolerance counts]");
  command
      .add_option("--particles", request.particles,
                  "Number of particles of all objects together, up to 1,000,000 [default: 10000]")
      ->check(require_whole_number);
  add_text_flag(command, "--resampling", request.resampling,
                "How particles are drawn: multinomial or systematic [default: multinomial]");
  command.add_flag("--augmented", request.augmented,
                   "Augmented MCL: add random particles while the touches fit worse than before");
  command.add_option("--seed", request.seed, "Seed of the particles' random numbers [default: 0]")
      ->check(require_whole_number);
}

void add_uncertainty_flags(CLI::App& command, Request& request) {
  command.add_option("--touch-sd-mm", request.touch_sd_mm,
                     "The robot's repeatability: standard deviation of the sensor's true position "
                     "about the reported one, along x and along y, mm. Independent from touch to "
                     "touch [default: the sensor model's, but not with particles; else 0, exact]");
  command.add_option("--touch-sd-deg", request.touch_sd_deg,
                     "The same of the sensor's angle, degrees [default: as for --touch-sd-mm]");
  command.add_option("--slip-sd-mm", request.slip_sd_mm,
                     "Standard deviation of how far the object moves between two touches, along x "
                     "and along y, mm; the motion noise of particles [default: 0, at rest; "
                     "particles: 1]");
  command.add_option("--slip-sd-deg", request.slip_sd_deg,
                     "The same of how far the object turns about its middle, degrees [default: 0; "
                     "particles: 5.73, which is 0.1 rad]");
  add_text_flag(
      command, "--none", request.none,
      "Prior weight of \"(none)\", an object that was never learned; a map has the weight 1. "
      "Without W (recordings stand before the flag) it is a ninth of the sum of the maps' weights: "
      "a probability of one in ten before the first touch. A sensor model's temperature tempers "
      "these odds with the evidence. (none) explains each touch by a piece "
      "of some known object; the pieces need not belong to one pose. One touch cannot tell: after "
      "it, the odds are about the prior's, unless a sensor model has learned what a touch of no "
      "known object is like. 0 leaves (none) out, as particles do. By default it is also left out "
      "where the bins are too wide to tell it, or where the learned sensor trusts no touch enough "
      "[default: as without W]")
      ->type_name("W")
      ->expected(0, 1)
      ->default_str("auto");
}

}  // namespace

void add_recognition_flags(CLI::App& command, Request& request, bool& verbose) {
  command.add_option("--maps", request.maps, "Maps of the known objects, or folders of maps");
  command.add_option(
      "--scene", request.scene,
      "Scene file (YAML); its keys are array, sensor_model, threshold, ratio, gamma, prior, "
      "touch_sd, slip_sd, none, act_below_mm, act_above, objects, region, bins, filter and device, "
      "and a flag overrides its key");
  command.add_option(
      "--sensor-model", request.sensor_model,
      "What was learned about the sensor (YAML): the threshold, the ratio, gamma "
      "and the touches' standard deviations, which flags and scene keys override; a likelihood "
      "table in the place of gamma and prior; and how sure to be: the temperature, press features, "
      "and whether the object was learned at all. Particles leave the standard deviations out "
      "[default: the sensor.yaml that 'palpate map' wrote beside the maps; none: Eq. 7]");
  add_text_flag(
      command, "--bins", request.bins,
      "Pose bins per object along x, y and theta, as 25x25x16; auto: as many as the refined pose "
      "needs, in steps of 0.6 times the maps' cell or 1.2 times the sensor's spread, whichever is "
      "larger, widened to half of --touch-sd-* or five quarters of --slip-sd-*, but at most 2.5 "
      "times; fine: also as the mode "
      "needs, in steps of 0.6 times the larger of both. Auto and fine take wider steps where the "
      "histogram's device memory is short; the region about an automatic pivot fits the largest "
      "array of all RECORDINGs [default: auto, or 25x25x16 where a range or a pivot is given]");
  add_text_flag(command, "--x-mm", request.x_mm,
                "Range of the pivot's x in the object frame, mm, as --x-mm=-10:10 [default: "
                "every place of an array that touches an object of the maps, or -10:10 where "
                "counts of --bins, another range or a pivot X,Y is given]");
  add_text_flag(command, "--y-mm", request.y_mm, "Range of the pivot's y [default: as for --x-mm]");
  add_text_flag(
      command, "--theta-deg", request.theta_deg,
      "Range of theta of T_object_robot, degrees, at most 360 wide; --theta-deg=-30:-30 fixes it, "
      "for an object that lies at 30 degrees in the robot frame [default: 0:360]");
  add_text_flag(
      command, "--pivot-mm", request.pivot_mm,
      "Point X,Y in the robot frame, mm, about which theta turns; the bins' x and y are the "
      "point's coordinates in the object frame. auto: the array's centre at the first touch of "
      "each unknown with an element in contact [default: auto, or 0,0 where counts of --bins or a "
      "range is given]");
  command.add_option("--prior", request.prior,
                     "Probability that an unseen cell is occupied; refused beside a sensor model "
                     "with a table [default: the maps' own]");
  command.add_option("--gamma", request.gamma,
                     "Probability that an element's contact class is random; refused beside a "
                     "sensor model with a table [default: the sensor model's, or 0.1]");
  add_uncertainty_flags(command, request);
  command.add_option(
      "--threshold", request.threshold,
      "Contact threshold, in the recording's pressure unit [default: the sensor model's, or 2 kPa; "
      "required for raw pressure without a model]");
  command.add_option("--ratio", request.ratio,
                     "Threshold as a fraction of the touch's largest pressure [default: the sensor "
                     "model's, or 0.3]");
  command.add_option(
      "--act-below-mm", request.act_below_mm,
      "Decide to act where 95 % of the belief lies within this distance of the pose, "
      "mm; the distance is that of the object's points, root mean square "
      "[default: 0.5]");
  command.add_option("--act-above", request.act_above,
                     "Decide to act where the best object has at least this probability "
                     "[default: 0.99]");
  add_filter_flags(command, request);
  command.add_option(
      "--device", request.device,
      "Vulkan device, by index or a part of its name; a search by bounds needs none");
  command.add_flag("--verbose", verbose,
                   "Say on standard error how the device works: its memory, the likelihood's path, "
                   "the lattice, the seconds it took");
}

void hide_particle_flags(CLI::App& command) {
  for (const char* flag : {"--particles", "--resampling", "--augmented", "--seed"}) {
    command.get_option(flag)->group("");
  }
}

void add_unknown_flags(CLI::App& command, Request& request) {
  add_text_flag(command, "--frames", request.frames,
                "Use the touches A to B - 1 of every recording, counted from 0, as A:B");
  command
      .add_option("--touches", request.touches,
                  "Use the first N touches of every recording [default: all]")
      ->check(require_whole_number);
  command.add_flag("--each-frame", request.each_frame,
                   "Recognise every touch by itself, as an unknown object of its own");
}

void tell_on_stderr(const std::string& sentence) {
  fmt::print(stderr, "palpate: {}\n", in_flags(sentence));
}

Recogniser open_telling(Device* device, const RecognitionTask& task,
                        const std::function<void()>& cancel_point) {
  Recogniser recogniser = open_recogniser(device, task, {.cancel_point = cancel_point});
  std::ranges::for_each(task.remarks, tell_on_stderr);
  return recogniser;
}

void add_recognition_files(const Request& request, CommandFiles& files) {
  for (const auto& [option, file] : files_of(request)) {
    files.reads("--" + option, file);
  }
}

}  // namespace palpate::cli
