#include <cstdio>
#include <exception>
#include <iostream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "io/standard_streams.hpp"
#include "palpate/error.hpp"

namespace palpate::bench {
namespace {

/// A subcommand with the flags that all have, which calls `run` with the options.
template <typename Options>
CLI::App* add_command(CLI::App& app, const char* name, const char* description, Options& options,
                      void (*run)(const Options&, std::span<char* const>),
                      std::span<char* const> command_line) {
  CLI::App* command = app.add_subcommand(name, description);
  command->add_option("--json", options.json, "Write the results to this file");
  command->add_flag("--quick", options.quick, "Small sizes and few trials, in less than a minute");
  command->add_option("--device", options.device, "Vulkan device, by a part of its name or index");
  command->callback([&options, run, command_line] { run(options, command_line); });
  return command;
}

void add_own_data(CLI::App& command, OwnDataOptions& own) {
  command.add_option("--maps", own.maps, "Maps of your objects, or folders of maps");
  command.add_option("--recordings", own.recordings,
                     "Recordings of unknowns, folders of them, or manifests as of palpate batch. "
                     "Where they know the object or its pose, the sweep tells accuracy and errors");
  command.add_option("--scene", own.scene, "Scene file (YAML), as of palpate recognize");
  command.add_option("--sensor-model", own.sensor_model, "What palpate calibrate has learned");
  command.add_option("--x-mm", own.x_mm,
                     "Range of x, as of palpate recognize [default: every place of an array that "
                     "touches an object of the maps]");
  command.add_option("--y-mm", own.y_mm, "Range of y");
  command.add_option("--theta-deg", own.theta_deg, "Range of theta, degrees [default: 0:360]");
  command.add_option("--pivot-mm", own.pivot_mm, "Point about which theta turns, X,Y or auto");
  command.add_option("--threshold", own.threshold, "Contact threshold, in the recordings' unit");
  command.add_option("--ratio", own.ratio, "Threshold as a fraction of the largest pressure");
}

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) try {
  using namespace palpate::bench;
  palpate::open_closed_streams();
  const std::span<char* const> command_line(argv, argc);
  CLI::App app("Measures Palpate's speed and accuracy on simulated letters.", "palpate-bench");
  app.require_subcommand(1);
  RunOptions kernels;
  add_command(
      app, "kernels",
      "Measure every kernel, in some minutes on two CPU cores: likelihood (ns per pose bin, "
      "element and touch), reductions (ms), maps (s), many unknowns (per second) and "
      "latency (ms), with errors in nats against float64",
      kernels, measure_kernels, command_line);
  constexpr const char* trials = "Trials per letter (default 10, or 4 with --quick)";
  FitOptions fit;
  CLI::App* command = add_command(app, "fit",
                        "Measure how well touches of learned letters and of shapes never learned "
                        "fit, in some minutes on two CPU cores: pairs told apart and verdicts, of "
                        "arrays of 6 x 6 and 16 x 16 elements",
                        fit, measure_fit, command_line);
  command->add_option("--trials", fit.trials,
                      "Trials per letter and shape (default 20, or 2 with --quick)");
  BeliefsOptions beliefs;
  command = add_command(app, "beliefs",
                        "Measure how honest beliefs are, in some 40 minutes on two CPU cores: "
                        "misplaced touches, how well touches tell how far they are misplaced, "
                        "objects never learned, objects that slip, planned touches, and what each "
                        "costs",
                        beliefs, measure_beliefs, command_line);
  command->add_option("--part", beliefs.part, "Measure only this part")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(belief_parts), std::end(belief_parts))));
  command->add_option("--trials", beliefs.trials,
                      "Unknowns per letter and shape (default: each part's own)");
  command->add_option("--plots", beliefs.plots, "Draw charts in this folder, as PNG and SVG");
  BoundedRunOptions bounded;
  command = add_command(app, "bounded",
                        "Measure the posterior by bounds, in some 15 minutes on two CPU cores: its "
                        "time and memory at 10,000 to 1,000,000,000 bins beside the dense engine, "
                        "and its certificates beside the errors",
                        bounded, measure_bounded, command_line);
  command->add_option("--part", bounded.part, "Measure only this part")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(bounded_parts), std::end(bounded_parts))));
  command->add_option("--plots", bounded.plots, "Draw the chart in this folder, as PNG and SVG");
  command->add_option("--presses", bounded.presses,
                      "Also measure the recordings of everyday objects in this folder");
  SweepOptions sweep;
  command = add_command(app, "sweep",
                        "Measure speed against error on simulated letters, in some 20 minutes on "
                        "two CPU cores: every filter, from 100 to 10,000,000 bins per object, on "
                        "maps of several cell sizes. With --maps and --recordings, the same of "
                        "your own objects: how many bins they need, and what bins cost on this "
                        "device",
                        sweep, run_sweep, command_line);
  command->add_option("--html", sweep.html, "Write the results as a page with charts and tables");
  command->add_option("--plots", sweep.plots,
                      "Draw the page's charts in this folder, as PNG and SVG");
  command->add_option("--max-bins", sweep.max_bins,
                      "Most bins per object (default 10,000,000, or 100,000 with --quick)");
  command->add_option("--trials", sweep.trials, trials);
  add_own_data(*command, sweep.own);
  BinStepsOptions bin_steps;
  command = add_command(app, "bin-steps",
                        "Measure the refined pose's error against the step of the bins, after 3, 5 "
                        "and 9 touches at random poses, over windows about the truth",
                        bin_steps, run_bin_steps, command_line);
  command->add_option("--trials", bin_steps.trials,
                      "Trials per letter (default 20, or 1 with --quick)");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) != 0) {
      return 2;
    }
    std::cout.flush();  // --help
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    throw palpate::Error(palpate::Fault::system,
                         "standard output: cannot be written; is the disk full?");
  }
  return 0;
} catch (const palpate::Error& error) {
  std::fprintf(stderr, "palpate-bench: %s\n", error.what());
  return error.fault() == palpate::Fault::input ? 2 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "palpate-bench: %s\n", error.what());
  return 1;
}
