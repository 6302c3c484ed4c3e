#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/interruption.hpp"
#include "cli/options.hpp"
#include "cli/page/page_server.hpp"
#include "cli/page/viewed_files.hpp"
#include "palpate/error.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;

struct ViewArguments {
  std::vector<std::string> paths;
  PageAddress page{.port = default_page_port};
};

void view(const ViewArguments& options) {
  const ViewedFiles files(options.paths);
  PageServer server(options.page,
                    {.get = [&files](const std::string& path) { return files.get(path); },
                     .act =
                         [](const nlohmann::json&) {
                           throw Error(Fault::input, "saved files are only looked at");
                         }});
  server.feed().set("files", files.list());
  const Interruption interruption;
  fmt::print("{}; Ctrl-C ends it\n", server.words());
  std::fflush(stdout);
  while (!interruption.requested()) {
    std::this_thread::sleep_for(50ms);
  }
}

}  // namespace

void add_view(CLI::App& app) {
  const auto [command, options] = add_command<ViewArguments>(
      app, "view",
      "Show saved files in a browser, until Ctrl-C: recordings frame by frame, maps, and results "
      "of recognize, live and batch, which can be filtered and sorted",
      view);
  add_required(
      *command, "PATH", options->paths,
      "Recordings, maps, JSON of recognize or live, folders of batch, or folders of such files");
  add_page_flags(*command, options->page);
}

}  // namespace palpate::cli
