#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "options/option.hpp"
#include "recognition/resolve.hpp"

namespace palpate::cli {

// What the command line asks of a recognition fills a Request, which resolve() makes a task.

/// Adds the flags of maps, sensor, lattice and filter, and --verbose.
void add_recognition_flags(CLI::App& command, Request& request, bool& verbose);

/// Leaves the flags of particles out of the help of a command that needs a belief over bins. They
/// are read still, so that the command refuses them with its reason.
void hide_particle_flags(CLI::App& command);

/// Adds the flags that select unknowns from recordings.
void add_selection_flags(CLI::App& command, Request& request);

/// Adds the flag of one option. Its Errors name flag, value and what to give instead.
/// @param help "": the option's own
void add_option_flag(CLI::App& command, Request& request, std::string_view name,
                     const std::string& help = "");

/// A device that is opened once it is needed.
class DeviceInWaiting {
 public:
  explicit DeviceInWaiting(std::string name) : name_(std::move(name)) {}
  Device& operator()() { return device_ ? *device_ : device_.emplace(Device::open(name_)); }
  /// Opens the device of a task's filter; null where that uses none.
  /// @throws Error where there is no device of the name that was given, also where none is used
  Device* of(const RecognitionTask& task) {
    if (!uses_device(task) && name_.empty()) {
      return nullptr;
    }
    Device& device = (*this)();
    return uses_device(task) ? &device : nullptr;
  }

 private:
  std::string name_;
  std::optional<Device> device_;
};

/// Says a sentence to the user, on standard error, its options as flags.
void tell_on_stderr(const std::string& sentence);

/// Opens the task's filter, then tells the task's remarks: bins that do not fit deserve only their
/// refusal. Throws Error.
/// @param device may be null where uses_device() is false
/// @param cancel_point see FilterResources
Recogniser open_telling(Device* device, const RecognitionTask& task,
                        const std::function<void()>& cancel_point = {});

/// Adds the files that the task of a completed request was read from.
void add_recognition_files(const Request& request, CommandFiles& files);

}  // namespace palpate::cli
