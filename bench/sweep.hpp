#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace palpate::bench {

struct SweepOptions {
  std::string device;  ///< a device's name or index; empty for the best
  std::string json;    ///< file to write; empty for none
  std::string html;    ///< page to write; empty for none
  std::string plots;   ///< folder to write the page's charts to; empty for none
  /// Per object of the runs; by default 10,000,000, or 100,000 if quick. What bounds the error is
  /// measured in windows of lattices of its own.
  std::optional<std::int64_t> max_bins;
  std::optional<int> trials;  ///< per letter; by default 10, or 4 if quick
  bool quick = false;         ///< few counts and trials, in less than a minute
};

/// Speed against error on simulated letters: every filter at counts from 100 to 10,000,000 bins per
/// object, maps of several cell sizes, the engine's ways to evaluate the likelihood beside two
/// baselines, and what bounds the error when no bin does. Prints what was measured, as the tables
/// of SWEEP.md, and writes what is asked for.
/// @throws Error where an option is out of range, or the device, a file or a folder cannot be
/// opened
void run_sweep(const SweepOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
