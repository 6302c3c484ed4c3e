#include <cstdio>
#include <exception>
#include <iostream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "palpate/error.hpp"
#include "report.hpp"

int main(int argc, char** argv) try {
  using namespace palpate::bench;
  CLI::App app("Measures Palpate's speed on simulated letters. ./dev bench measures its accuracy.",
               "palpate-bench");
  app.require_subcommand(1);
  RunOptions options;
  const auto add = [&](const char* name, const char* description, auto* measure) {
    CLI::App* command = app.add_subcommand(name, description);
    command->add_option("--json", options.json, "Write the results to this file");
    command->add_flag("--quick", options.quick,
                      "Small sizes and few trials, in less than a minute");
    command->add_option("--device", options.device,
                        "Vulkan device, by a part of its name or index");
    command->callback([=, &options] { measure(options, std::span(argv, argc)); });
    return command;
  };
  add("kernels",
      "Measure every kernel, in some minutes on two CPU cores: likelihood (ns per pose bin, "
      "element and touch), reductions (ms), maps (s), many unknowns (per second) and "
      "latency (ms), with errors in nats against float64",
      measure_kernels);
  add("bounded",
      "Measure the posterior by bounds, in less than 20 minutes on two CPU cores: its "
      "time and memory, in large scenes and beside the dense engine",
      measure_bounded)
      ->add_option("--part", options.part, "Measure only this part")
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
