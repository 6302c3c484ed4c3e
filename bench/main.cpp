#include <cstdio>
#include <exception>
#include <iostream>
#include <span>

#include <CLI/CLI.hpp>

#include "experiment.hpp"
#include "kernels.hpp"
#include "palpate/error.hpp"
#include "standard_streams.hpp"
#include "sweep.hpp"

int main(int argc, char** argv) {
  palpate::open_closed_streams();
  CLI::App app("Measures Palpate's speed and accuracy on simulated letters.", "palpate-bench");
  app.require_subcommand(1);
  palpate::bench::KernelOptions options;
  auto* kernels = app.add_subcommand(
      "kernels",
      "Likelihood (ns per pose bin, element and touch), reductions (ms), maps (s), many unknowns "
      "(per second) and latency (ms), with errors in nats against float64; takes some minutes");
  kernels->add_option("--json", options.json, "Also write the results to this file");
  kernels->add_flag("--quick", options.quick, "Small sizes, in less than a minute");
  kernels->add_option("--device", options.device, "Vulkan device, by a part of its name or index");
  kernels->callback([&] { palpate::bench::measure_kernels(options, std::span(argv, argc)); });
  palpate::bench::ExperimentOptions experiment_options;
  auto* experiment = app.add_subcommand(
      "experiment",
      "The paper's Sec. IV on simulated letters: identity and pose error against the number of "
      "touches, for histogram and particle filters; calibration; misplaced touches; objects "
      "never learned");
  experiment->add_option("--trials", experiment_options.trials,
                         "Trials per letter, 10 by default, or 4 with --quick");
  experiment->add_option("--touches", experiment_options.touches,
                         "Touches per trial, 50 by default, or 12 with --quick; at most 192");
  experiment->add_option("--json", experiment_options.json, "Also write the results to this file");
  experiment->add_option("--csv", experiment_options.csv, "Also write tables to this folder");
  experiment->add_option("--plots", experiment_options.plots,
                         "Also draw the paper's figures in this folder, as PNG and SVG");
  experiment->add_flag("--quick", experiment_options.quick, "Few trials and touches, in seconds");
  experiment->add_option("--device", experiment_options.device,
                         "Vulkan device, by a part of its name or index");
  experiment->callback(
      [&] { palpate::bench::run_experiment(experiment_options, std::span(argv, argc)); });
  palpate::bench::SweepOptions sweep_options;
  auto* sweep = app.add_subcommand(
      "sweep",
      "Speed against error on simulated letters: every filter from 100 to 10,000,000 bins per "
      "object and maps of several cell sizes; takes many minutes on a CPU");
  sweep->add_option("--json", sweep_options.json, "Also write the results to this file");
  sweep->add_option("--html", sweep_options.html, "Also write them as a page with charts");
  sweep->add_option("--plots", sweep_options.plots,
                    "Also write the page's charts to this folder, as PNG and SVG");
  sweep->add_option("--max-bins", sweep_options.max_bins, "Most bins per object");
  sweep->add_option("--trials", sweep_options.trials,
                    "Trials per letter, 10 by default, or 4 with --quick; few of them in full "
                    "where bins are many");
  sweep->add_flag("--quick", sweep_options.quick, "Few counts and trials, in less than a minute");
  sweep->add_option("--device", sweep_options.device,
                    "Vulkan device, by a part of its name or index");
  sweep->callback([&] { palpate::bench::run_sweep(sweep_options, std::span(argv, argc)); });
  try {
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
}
