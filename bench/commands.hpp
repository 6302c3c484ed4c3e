#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace palpate::bench {

/// What all commands take. Files and folders that are empty are not written.
struct RunOptions {
  std::string device;  ///< a device's name or index; empty for the best
  std::string json;    ///< file for the results
  bool quick = false;  ///< small sizes and few trials, in less than a minute
};

struct BoundedRunOptions : RunOptions {
  std::string part;   ///< the only part to measure; empty for all
  std::string plots;  ///< folder for the picture
};
/// Names of the parts, in order.
inline constexpr const char* bounded_parts[] = {"speed", "mode", "streaming", "large", "growth"};

// Each prints its results as Markdown tables and writes the files that its options name.
// They throw Error where an option is out of range, or the device, a file or a folder cannot be
// opened.

/// Speed, memory and error of every kernel, beside two baselines and float64.
void measure_kernels(const RunOptions& options, std::span<char* const> command_line);

/// Every way to evaluate the likelihood, in turn on the same lattices: its time, and its error
/// against float64. The sweep's tables and charts show them.
/// @throws Error unless some touch has at least half its elements in No Contact, which an array at
/// rest needs to gain anything
void compare_paths(const RunOptions& options, std::span<char* const> command_line);

/// The posterior by bounds: its time for nine touches at rising numbers of bins, touch by touch and
/// in large scenes, and its memory.
void measure_bounded(const BoundedRunOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
