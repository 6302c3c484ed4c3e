#include <cstdio>
#include <exception>
#include <iostream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "io/descriptor.hpp"
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

}  // namespace
}  // namespace palpate::bench

int main(int argc, char** argv) try {
  using namespace palpate::bench;
  palpate::open_closed_streams();
  const std::span<char* const> command_line(argv, argc);
  CLI::App app("Measures Palpate's speed on simulated letters. ./dev bench measures its accuracy.",
               "palpate-bench");
  app.require_subcommand(1);
  RunOptions kernels;
  add_command(
      app, "kernels",
      "Measure every kernel, in some minutes on two CPU cores: likelihood (ns per pose bin, "
      "element and touch), reductions (ms), maps (s), many unknowns (per second) and "
      "latency (ms), with errors in nats against float64",
      kernels, measure_kernels, command_line);
  RunOptions paths;
  add_command(app, "paths",
              "Time every way to evaluate the likelihood in turn (ns per pose bin, element and "
              "touch), in less than a minute, with errors in nats against float64",
              paths, compare_paths, command_line);
  BoundedRunOptions bounded;
  CLI::App* command =
      add_command(app, "bounded",
                  "Measure the posterior by bounds, in some 15 minutes on two CPU cores: its "
                  "time and memory at 10,000 to 1,000,000,000 bins beside the dense engine",
                  bounded, measure_bounded, command_line);
  command->add_option("--part", bounded.part, "Measure only this part")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(bounded_parts), std::end(bounded_parts))));
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
