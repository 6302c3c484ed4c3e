#include "report.hpp"

#include <chrono>
#include <cstdio>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace palpate::bench {

namespace {

constexpr const char* row = "| {:<28} | {:<46} | {:<28} | {:<8} | {:<7} |\n";

}  // namespace

std::string plain_text(const Json& value) {
  if (value.is_array()) {
    return fmt::format("{}", fmt::join(value.get<std::vector<std::string>>(), "; "));
  }
  return value.is_string()         ? value.get<std::string>()
         : value.is_number_float() ? fmt::format("{}", value.get<double>())
                                   : value.dump();
}

std::string count_text(double count) {
  return count >= 0.9995e9   ? fmt::format("{:.3g} G", count / 1e9)
         : count >= 0.9995e6 ? fmt::format("{:.3g} M", count / 1e6)
         : count >= 0.9995e3 ? fmt::format("{:.3g} k", count / 1e3)
                             : fmt::format("{:.3g}", count);
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
    std::string value = fmt::format("{:>10.4g} {}", m.value, m.unit);
    std::string goal;
    if (m.goal) {
      const bool most = m.goal->kind == Goal::Kind::at_most;
      of[most ? "at_most" : "at_least"] = m.goal->value;
      of["reached"] = most ? m.value <= m.goal->value : m.value >= m.goal->value;
      goal = fmt::format("{} {:.4g}", most ? "≤" : "≥", m.goal->value);
    }
    if (m.interval) {
      of["low"] = m.interval->low;
      of["high"] = m.interval->high;
      value += fmt::format(" ({:.4g} to {:.4g})", m.interval->low, m.interval->high);
    }
    const char* reached = !m.goal ? "" : of["reached"] ? "yes" : "no";
    fmt::print(fmt::runtime(row), measured.name, m.name, value, goal, reached);
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
