#pragma once

#include <span>
#include <string>

namespace palpate::bench {

/// What all commands take.
struct RunOptions {
  std::string device;  ///< a device's name or index; empty for the best
  std::string json;    ///< file for the results; none where it is empty
  bool quick = false;  ///< small sizes and few trials, in less than a minute
  std::string part;    ///< the only part to measure, of a command that has parts; empty for all
};

/// Names of the parts of `bounded`, in order.
inline constexpr const char* bounded_parts[] = {"speed", "mode",   "streaming",
                                                "large", "growth", "search"};

// Each prints its results as Markdown tables and writes them to the file that its options name.
// They throw Error where the device or the file cannot be opened.

/// Speed, memory and error of every kernel, beside two baselines and float64.
void measure_kernels(const RunOptions& options, std::span<char* const> command_line);

/// Every way to evaluate the likelihood, in turn on the same lattices: its time, and its error
/// against float64. The sweep's tables and charts show them.
/// @throws Error unless some touch has at least half its elements in No Contact, which an array at
/// rest needs to gain anything
void compare_paths(const RunOptions& options, std::span<char* const> command_line);

/// The posterior by bounds: its time for nine touches at rising numbers of bins, touch by touch and
/// in large scenes, its memory, and where it searches.
void measure_bounded(const RunOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
