#include "report.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string_view>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace palpate::bench {

namespace {

constexpr const char* row = "| {:<28} | {:<46} | {:<28} | {:<8} | {:<7} |\n";

/// Strings without quotes, numbers in their shortest form.
std::string plain_text(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

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
  constexpr double ramp_s = 0.2;
  std::vector<std::vector<double>> seconds(contenders.size());
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      double last = 0.0;
      for (double all = 0.0; all < ramp_s; all += last) {
        last = seconds_of(contenders[i]);
      }
      seconds[i].push_back(last);
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

Measurement share_of(const std::string& name, int count, std::size_t trials,
                     std::optional<Goal> goal) {
  const auto [low, high] = wilson_interval(count, trials);
  return {.name = name,
          .value = 100.0 * count / static_cast<double>(trials),
          .unit = "%",
          .goal = goal,
          .interval = Interval{100.0 * low, 100.0 * high}};
}

Report::Report(const RunOptions& options, std::span<char* const> command_line)
    : file_(options.json.empty() ? std::nullopt
                                 : std::optional<AtomicFile>(std::in_place, options.json)),
      device_(Device::open(options.device)) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  document_ = {{"device", device_.name()},
               {"host threads", std::thread::hardware_concurrency()},
               {"compiler", PALPATE_COMPILER},
               {"data", "simulated letters and sensor; the paper's recordings are not public"},
               {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", now)},
               {"command line", fmt::format("{}", fmt::join(command_line, " "))}};
  for (const auto& [name, value] : document_.items()) {
    fmt::print("{}: {}  \n", name, plain_text(value));
  }
}

void Report::add(const Case& measured) {
  if (!document_.contains("cases")) {
    fmt::print("\n");
    fmt::print(fmt::runtime(row), "case", "measured", "value", "goal", "reached");
    fmt::print("|:--|:--|--:|:--|:--|\n");
  }
  Json record{{"name", measured.name}};
  std::vector<std::string> facts;
  for (const auto& [name, value] : measured.facts.items()) {
    record[name] = value;
    facts.push_back(fmt::format("{}: {}", name, plain_text(value)));
  }
  fmt::print("| **{}** | {} | | | |\n", measured.name, fmt::join(facts, ", "));
  for (const Measurement& m : measured.measurements) {
    Json& of = record["measurements"].emplace_back(
        Json{{"name", m.name}, {"value", m.value}, {"unit", m.unit}});
    std::string text = fmt::format("{:>10.4g} {}", m.value, m.unit);
    std::string goal;
    if (m.goal) {
      const auto [is_most, value] = *m.goal;
      of[is_most ? "at_most" : "at_least"] = value;
      of["reached"] = is_most ? m.value <= value : m.value >= value;
      goal = fmt::format("{} {:.4g}", is_most ? "≤" : "≥", value);
    }
    if (m.interval) {
      of["low"] = m.interval->low;
      of["high"] = m.interval->high;
      text += fmt::format(" ({:.4g} to {:.4g})", m.interval->low, m.interval->high);
    }
    const char* reached = !m.goal ? "" : of["reached"] ? "yes" : "no";
    fmt::print(fmt::runtime(row), measured.name, m.name, text, goal, reached);
  }
  std::fflush(stdout);
  document_["cases"].push_back(std::move(record));
}

void Report::write() {
  if (file_) {
    file_->write(document_.dump(2) + "\n");
    file_->commit();
  }
}

}  // namespace palpate::bench
