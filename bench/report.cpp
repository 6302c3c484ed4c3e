#include "report.hpp"

#include <cstdio>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

std::string row(const std::string& name, const Measurement& m) {
  std::string goal;
  std::string reached;
  if (m.goal) {
    goal = fmt::format("{} {:.4g}", m.goal->kind == Goal::Kind::at_most ? "≤" : "≥", m.goal->value);
    reached = m.reached() ? "yes" : "no";
  }
  const std::string unit =
      m.interval ? fmt::format("{} ({:.4g} to {:.4g})", m.unit, m.interval->low, m.interval->high)
                 : m.unit;
  return fmt::format("| {:<28} | {:<46} | {:>10.4g} {:<17} | {:<8} | {:<7} |", name, m.name,
                     m.value, unit, goal, reached);
}

}  // namespace

bool Measurement::reached() const {
  return !goal || (goal->kind == Goal::Kind::at_most ? value <= goal->value : value >= goal->value);
}

Measurement share_of(const std::string& name, int count, std::size_t trials,
                     std::optional<Goal> goal) {
  const auto of = static_cast<int>(trials);
  const Interval interval = wilson_interval(count, of);
  return {.name = name,
          .value = 100.0 * count / of,
          .unit = "%",
          .goal = goal,
          .interval = Interval{100.0 * interval.low, 100.0 * interval.high}};
}

Json record_of(const Measurement& m) {
  Json record{{"name", m.name}, {"value", m.value}, {"unit", m.unit}};
  if (m.goal) {
    record[m.goal->kind == Goal::Kind::at_most ? "at_most" : "at_least"] = m.goal->value;
    record["reached"] = m.reached();
  }
  if (m.interval) {
    record["low"] = m.interval->low;
    record["high"] = m.interval->high;
  }
  return record;
}

Report::Report(Json facts) : document_(std::move(facts)) {
  document_["cases"] = Json::array();
  fmt::print("\n| {:<28} | {:<46} | {:<28} | {:<8} | {:<7} |\n|:--|:--|--:|:--|:--|\n", "case",
             "measured", "value", "goal", "reached");
  std::fflush(stdout);
}

void Report::add(const Case& measured) {
  Json record{{"name", measured.name}};
  std::string facts;
  for (const auto& [name, value] : measured.facts.items()) {
    record[name] = value;
    facts += fmt::format("{}{}: {}", facts.empty() ? "" : ", ", name, plain_text(value));
  }
  record["measurements"] = Json::array();
  fmt::print("| **{}** | {} | | | |\n", measured.name, facts);
  for (const Measurement& m : measured.measurements) {
    fmt::print("{}\n", row(measured.name, m));
    record["measurements"].push_back(record_of(m));
  }
  std::fflush(stdout);
  document_["cases"].push_back(std::move(record));
}

}  // namespace palpate::bench
