#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "recognition/proportion.hpp"

namespace palpate::bench {

using palpate::Interval;
using palpate::wilson_interval;

/// Seconds that the call takes.
double seconds_of(const std::function<void()>& call);

/// Runs all contenders in turn, `repeats` times: whatever else the machine does meanwhile meets
/// them alike. Returns their seconds, [contender][repeat]. Warm them up before.
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
class ErrorStatistics {
 public:
  /// Counts one error; one that is not a number makes the largest so, too.
  void add(double error);
  double largest() const { return largest_; }
  double rms() const;
  std::uint64_t count() const { return count_; }

 private:
  double largest_ = 0.0;
  double squares_ = 0.0;
  std::uint64_t count_ = 0;
};

}  // namespace palpate::bench
