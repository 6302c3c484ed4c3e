#include "report.hpp"

#include <cstdio>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

/// Strings as they are, lists of them separated by semicolons, anything else as JSON.
std::string text_of(const nlohmann::ordered_json& value) {
  if (value.is_string()) {
    return value.get<std::string>();
  }
  if (value.is_array() && !value.empty() && value.front().is_string()) {
    std::string text;
    for (const auto& item : value) {
      text += (text.empty() ? "" : "; ") + item.get<std::string>();
    }
    return text;
  }
  return value.dump();
}

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

Report::Report(nlohmann::ordered_json facts) : document_(std::move(facts)) {
  for (const auto& [name, value] : document_.items()) {
    fmt::print("{}: {}  \n", name, text_of(value));
  }
  document_["cases"] = nlohmann::ordered_json::array();
  fmt::print("\n| {:<28} | {:<46} | {:<28} | {:<8} | {:<7} |\n|:--|:--|--:|:--|:--|\n", "case",
             "measured", "value", "goal", "reached");
  std::fflush(stdout);
}

void Report::add(const Case& measured) {
  nlohmann::ordered_json record{{"name", measured.name}};
  std::string facts;
  for (const auto& [name, value] : measured.facts.items()) {
    record[name] = value;
    facts += fmt::format("{}{}: {}", facts.empty() ? "" : ", ", name, text_of(value));
  }
  record["measurements"] = nlohmann::ordered_json::array();
  fmt::print("| **{}** | {} | | | |\n", measured.name, facts);
  for (const Measurement& m : measured.measurements) {
    fmt::print("{}\n", row(measured.name, m));
    nlohmann::ordered_json entry{{"name", m.name}, {"value", m.value}, {"unit", m.unit}};
    if (m.goal) {
      entry[m.goal->kind == Goal::Kind::at_most ? "at_most" : "at_least"] = m.goal->value;
      entry["reached"] = m.reached();
    }
    if (m.interval) {
      entry["low"] = m.interval->low;
      entry["high"] = m.interval->high;
    }
    record["measurements"].push_back(std::move(entry));
  }
  std::fflush(stdout);
  document_["cases"].push_back(std::move(record));
}

}  // namespace palpate::bench
