#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "io/atomic_file.hpp"
#include "palpate/device.hpp"
#include "recognition/evaluation.hpp"

namespace palpate::bench {

/// What all commands take.
struct RunOptions {
  std::string device;  ///< a device's name or index; empty for the best
  std::string json;    ///< file for the results; none where it is empty
  bool quick = false;  ///< small sizes and few trials, in less than a minute
  std::string part;    ///< the only part to measure, of a command that has parts; empty for all
};

/// Seconds that the call takes.
double seconds_of(const std::function<void()>& call);

/// Runs all contenders in turn, `repeats` times: whatever else the machine does meanwhile meets
/// them alike. Returns their seconds, [contender][repeat]. Warm them up before. Of calls that take
/// less than a fifth of a second, the last of as many as fill it counts: a GPU that waited for
/// another contender runs three times slower at first.
std::vector<std::vector<double>> interleave(std::span<const std::function<void()>> contenders,
                                            int repeats);

/// Median seconds of `repeats` calls, after one that is not counted.
double median_seconds(const std::function<void()>& call, int repeats);

double median(std::span<const double> values);
/// The smallest value that at least this fraction of the values does not exceed.
double quantile(std::span<const double> values, double fraction);

/// Resident memory of the process. The peak is since the last restart_peak_memory(), or since the
/// process began where the kernel does not allow that. restart_peak_memory() first gives memory
/// that the process has freed back to the system: what is taken afterwards then shows.
std::uint64_t resident_bytes();
std::uint64_t peak_resident_bytes();
void restart_peak_memory();

/// Largest and root mean square of what was added.
struct ErrorStatistics {
  double largest = 0.0;
  double squares = 0.0;
  std::uint64_t count = 0;

  /// Counts one error; one that is not a number makes the largest so, too.
  void add(double error) {
    const double size = std::abs(error);
    largest = size <= largest ? largest : size;
    squares += error * error;
    ++count;
  }
  double rms() const { return std::sqrt(squares / static_cast<double>(count)); }
};

using Json = nlohmann::ordered_json;

/// What a measured value is held against.
struct Goal {
  bool is_most = true;  ///< else the least that is to be reached
  double value = 0.0;
};
inline Goal at_most(double value) { return {true, value}; }
inline Goal at_least(double value) { return {false, value}; }

struct Measurement {
  std::string name;
  double value = 0.0;
  std::string unit;
  std::optional<Goal> goal = {};
  std::optional<Interval> interval = {};  ///< of the value, 95 %
};
/// `count` of `trials` in percent, with its 95 % score interval (Wilson).
Measurement share_of(const std::string& name, int count, std::size_t trials,
                     std::optional<Goal> goal = {});

/// What was measured in one case. `facts` are its sizes and whatever else explains the numbers.
struct Case {
  std::string name;
  Json facts;
  std::vector<Measurement> measurements = {};

  void add(const std::vector<Measurement>& more) {
    measurements.insert(measurements.end(), more.begin(), more.end());
  }
};

/// A run of a command: its device, and its results, which begin with the facts that explain them.
class Report {
 public:
  /// Opens the file of the results, then the device, and prints the facts: what cannot be opened is
  /// known before the minutes of work.
  /// @throws Error where the file or the device cannot be opened
  Report(const RunOptions& options, std::span<char* const> command_line);

  Device& device() { return device_; }
  /// Device, host threads, compiler, data, date and command line; then the results.
  Json& document() { return document_; }
  /// Prints a case as rows of one Markdown table, and adds it to the document's `cases`.
  void add(const Case& measured);
  /// Writes the document, where a file is asked for.
  /// @throws Error where the disk refuses
  void write();

 private:
  std::optional<AtomicFile> file_;
  Device device_;
  Json document_;
};

// The commands.

/// Names of the parts of `bounded`, in order.
inline constexpr const char* bounded_parts[] = {"speed", "mode", "streaming", "large", "search"};

// Each prints its results as Markdown tables and writes them to the file that its options name.
// They throw Error where the device or the file cannot be opened.

/// Speed, memory and error of every kernel, beside a loop on the CPU and float64.
void measure_kernels(const RunOptions& options, std::span<char* const> command_line);

/// The posterior by bounds: its time for nine touches on lattices of several sizes, touch by touch
/// and in large scenes, its memory, and where it searches.
void measure_bounded(const RunOptions& options, std::span<char* const> command_line);

}  // namespace palpate::bench
