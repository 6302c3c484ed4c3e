#pragma once

#include <optional>
#include <span>
#include <string>

namespace palpate::bench {

struct ExperimentOptions {
  std::string device;          ///< a device's name or index; empty for the best
  std::string json;            ///< file to write; empty for none
  std::string csv;             ///< folder to write tables to; empty for none
  std::string plots;           ///< folder to write pictures to; empty for none
  std::optional<int> trials;   ///< per object; by default as in the paper, fewer if quick
  std::optional<int> touches;  ///< per trial
  bool quick = false;          ///< fewer trials and touches, in seconds
};

/// The experiments of Sec. IV on simulated letters: identity and pose against the number of
/// touches, for both filters. Beyond the paper: calibration, refined poses, an array that is
/// not quite where it is reported, and objects that were never learned. Prints the paper's claims
/// beside what was measured, and writes what is asked for.
/// @throws Error where trials or touches are out of range, or the device, a file or a folder cannot
/// be opened
void run_experiment(const ExperimentOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
