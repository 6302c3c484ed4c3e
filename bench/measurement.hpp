#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "recognition/proportion.hpp"

namespace palpate::bench {

using palpate::Interval;
using palpate::told_apart;
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

/// Of at least one value.
double mean(std::span<const double> values);
/// Of the mean of at least two values.
double standard_error(std::span<const double> values);
/// The 95 % interval of the mean of what at least three values are drawn from, by Student's t.
Interval mean_interval(std::span<const double> values);

/// The 95 % interval of told_apart(): Wilson's, for as many trials as there are values of the rarer
/// kind. The estimate varies no more than that (van Dantzig 1951).
Interval told_apart_interval(std::span<const double> lower, std::span<const double> higher);

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
