#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "commands.hpp"
#include "io/atomic_file.hpp"
#include "palpate/device.hpp"
#include "table.hpp"

namespace palpate::bench {

/// What a flag asks to be written: a file, or files of these names in a folder.
struct Output {
  const char* flag;
  std::string path;  ///< empty where nothing is asked for
  std::vector<std::string> names = {};
};

/// A run of a command: its device, the facts that explain its numbers, and its files.
class CommandRun {
 public:
  /// Opens the outputs, then the device, and prints the facts: what cannot be opened is known
  /// before the minutes of work.
  /// @param data what is measured, for the facts
  /// @throws Error where two outputs are one file, or a file, a folder or the device cannot be
  /// opened
  CommandRun(const RunOptions& options, std::vector<Output> outputs,
             std::span<char* const> command_line,
             const std::string& data =
                 "simulated letters and sensor; the paper's recordings are not public");

  Device& device() { return device_; }
  /// Device, host threads, compiler, data, date and command line.
  const Json& facts() const { return facts_; }
  /// Writes to the file of an output; an empty path is none.
  /// @throws Error where the disk refuses
  void write(const std::string& path, const std::string& content);

 private:
  std::map<std::string, std::unique_ptr<AtomicFile>> files_;  ///< by path
  Device device_;
  Json facts_;
};

/// Writes a file whole or not at all.
/// @throws Error where the disk refuses
void write_file(const std::filesystem::path& path, const std::string& content);

}  // namespace palpate::bench
