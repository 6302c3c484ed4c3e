#include "command_run.hpp"

#include <chrono>
#include <system_error>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "io/command_files.hpp"
#include "palpate/error.hpp"

namespace palpate::bench {

namespace {

/// Opens the files and makes the folders that are asked for.
std::map<std::string, std::unique_ptr<AtomicFile>> open_outputs(std::vector<Output> outputs) {
  std::erase_if(outputs, [](const Output& output) { return output.path.empty(); });
  CommandFiles files;
  for (const Output& output : outputs) {
    if (output.names.empty()) {
      files.writes(output.flag, output.path);
    }
    for (const std::string& name : output.names) {
      files.writes(output.flag, std::filesystem::path(output.path) / name);
    }
  }
  files.require_distinct();
  std::map<std::string, std::unique_ptr<AtomicFile>> opened;
  for (const Output& output : outputs) {
    if (std::error_code error; output.names.empty()) {
      opened.emplace(output.path, std::make_unique<AtomicFile>(output.path));
    } else if (!std::filesystem::create_directories(output.path, error) && error) {
      throw Error(Fault::input, fmt::format("folder {}: {}; give one that can be written to",
                                            output.path, error.message()));
    }
  }
  return opened;
}

}  // namespace

CommandRun::CommandRun(const RunOptions& options, std::vector<Output> outputs,
                       std::span<char* const> command_line, const std::string& data)
    : files_(open_outputs(std::move(outputs))), device_(Device::open(options.device)) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  facts_ = {{"device", device_.name()},
            {"host threads", std::thread::hardware_concurrency()},
            {"compiler", PALPATE_COMPILER},
            {"data", data},
            {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", now)},
            {"command line", fmt::format("{}", fmt::join(command_line, " "))}};
  for (const auto& [name, value] : facts_.items()) {
    fmt::print("{}: {}  \n", name, plain_text(value));
  }
}

void CommandRun::write(const std::string& path, const std::string& content) {
  if (!path.empty()) {
    files_.at(path)->write(content);
    files_.at(path)->commit();
  }
}

void write_file(const std::filesystem::path& path, const std::string& content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace palpate::bench
