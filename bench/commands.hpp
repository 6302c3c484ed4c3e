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

struct FitOptions : RunOptions {
  std::optional<int> trials;  ///< per letter and shape; by default 20, or 2 if quick
};

struct BeliefsOptions : RunOptions {
  std::string part;           ///< the only part to measure; empty for all
  std::string plots;          ///< folder for charts
  std::optional<int> trials;  ///< per letter and shape; by default each part's own
};
/// Names of the parts, in order.
inline constexpr const char* belief_parts[] = {"misplaced", "touch-sd", "none",
                                               "slip",      "plan",     "cost"};

struct BoundedRunOptions : RunOptions {
  std::string part;     ///< the only part to measure; empty for all
  std::string plots;    ///< folder for charts
  std::string presses;  ///< folder of recordings of everyday objects; without it, their part is not
                        ///< measured
};
/// Names of the parts, in order.
inline constexpr const char* bounded_parts[] = {"speed",  "mode",     "streaming", "large",
                                                "growth", "accuracy", "presses"};

/// A user's own maps and recordings, with the flags of `palpate recognize`.
struct OwnDataOptions {
  std::vector<std::string> maps;        ///< files or folders
  std::vector<std::string> recordings;  ///< files, folders, manifests or patterns
  std::string scene;
  std::string sensor_model;
  std::string x_mm;
  std::string y_mm;
  std::string theta_deg;
  std::string pivot_mm;
  std::optional<double> threshold;
  std::optional<double> ratio;

  friend bool operator==(const OwnDataOptions&, const OwnDataOptions&) = default;
};

struct SweepOptions : RunOptions {
  std::string html;                      ///< file for a page with charts and tables
  std::string plots;                     ///< folder for the page's charts
  std::optional<std::int64_t> max_bins;  ///< per object; by default 10,000,000, or 100,000 if quick
  std::optional<int> trials;             ///< per letter; by default 10, or 4 if quick
  OwnDataOptions own;                    ///< in the place of the letters, where it names any
};

struct BinStepsOptions : RunOptions {
  std::optional<int> trials;  ///< per letter; by default 20, or 1 if quick
};

// Each prints its results as Markdown tables and writes the files that its options name.
// They throw Error where an option is out of range, or the device, a file or a folder cannot be
// opened.

/// Speed, memory and error of every kernel, beside two baselines and float64.
void measure_kernels(const RunOptions& options, std::span<char* const> command_line);

/// How well learned letters and shapes never learned fit, after some numbers of touches: how often
/// the two are told apart, and their verdicts, of a small and a large array, on coarse bins and
/// with an array that is not quite where it is reported.
void measure_fit(const FitOptions& options, std::span<char* const> command_line);

/// How honest beliefs are: touches that are not quite where the robot says, with and without
/// averaging over where they may have been; how well touches tell how far they are misplaced;
/// objects that nobody learned and "none of these"; objects that slip; planned touches beside
/// random ones; and the time and memory of all these.
void measure_beliefs(const BeliefsOptions& options, std::span<char* const> command_line);

/// The posterior by bounds: its time for nine touches at rising numbers of bins, touch by touch and
/// in large scenes, its memory, and its certificates beside the distance from the dense posterior.
void measure_bounded(const BoundedRunOptions& options, std::span<char* const> command_line);

/// Speed against error on simulated letters: every filter at counts from 100 to 10,000,000 bins per
/// object, maps of several cell sizes, the engine's ways to evaluate the likelihood beside two
/// baselines, and the causes of the errors that more bins do not mend.
void run_sweep(const SweepOptions& options, std::span<char* const> command_line);

/// The same question of a user's own maps and recordings (options.own): over bin counts, accuracy,
/// pose errors and standard deviations, and what the histogram and bounds cost; then from which
/// count on nothing improves.
void run_own_sweep(const SweepOptions& options, std::span<char* const> command_line);

/// The error of the refined pose against the step of the bins, on the region that touch_region()
/// gives about the first touch: what BinWidth::automatic was chosen by.
void run_bin_steps(const BinStepsOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
