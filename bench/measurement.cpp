#include "measurement.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

namespace palpate::bench {

namespace {

/// A field of /proc/self/status, which are in KiB; 0 where there is none.
std::uint64_t status_bytes(std::string_view field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(field)) {
      return 1024 * std::stoull(line.substr(field.size()));
    }
  }
  return 0;
}

}  // namespace

double seconds_of(const std::function<void()>& call) {
  const auto start = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::vector<std::vector<double>> interleave(std::span<const std::function<void()>> contenders,
                                            int repeats) {
  std::vector<std::vector<double>> seconds(contenders.size());
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      seconds[i].push_back(seconds_of(contenders[i]));
    }
  }
  return seconds;
}

double median_seconds(const std::function<void()>& call, int repeats) {
  call();
  return median(interleave(std::span(&call, 1), repeats).front());
}

double median(std::span<const double> values) { return quantile(values, 0.5); }

double quantile(std::span<const double> values, double fraction) {
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double rank = std::ceil(fraction * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

std::uint64_t resident_bytes() { return status_bytes("VmRSS:"); }

std::uint64_t peak_resident_bytes() { return status_bytes("VmHWM:"); }

void restart_peak_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  std::ofstream("/proc/self/clear_refs") << '5';
}

void ErrorStatistics::add(double error) {
  const double size = std::abs(error);
  largest_ = size <= largest_ ? largest_ : size;
  squares_ += error * error;
  ++count_;
}

double ErrorStatistics::rms() const { return std::sqrt(squares_ / static_cast<double>(count_)); }

}  // namespace palpate::bench
