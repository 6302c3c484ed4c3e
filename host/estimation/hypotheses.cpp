#include "hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

void validate_hypotheses(std::span<const Hypothesis> hypotheses) {
  if (hypotheses.empty()) {
    throw Error(Fault::input, "no objects: give at least one map");
  }
  for (const auto& [map, weight] : hypotheses) {
    if (const auto fault = fault_of(map)) {
      throw Error(Fault::input, fmt::format("map '{}': {}", map.label, *fault));
    }
    if (!(weight > 0.0) || !std::isfinite(weight)) {
      throw Error(Fault::input,
                  fmt::format("map '{}': weight = {}: give a positive number, or leave the object "
                              "out",
                              map.label, weight));
    }
  }
}

double common_prior(std::span<const Hypothesis> hypotheses) {
  const OccupancyGrid& first = hypotheses.front().map;
  for (const Hypothesis& hypothesis : hypotheses) {
    // Readers may have rounded one of them.
    if (std::abs(hypothesis.map.prior - first.prior) > 1e-6) {
      throw Error(
          Fault::input,
          fmt::format("map '{}': prior {} differs from {} of map '{}'; build the maps "
                      "together, or say which prior to use",
                      hypothesis.map.label, hypothesis.map.prior, first.prior, first.label));
    }
  }
  return first.prior;
}

double log_total_weight(std::span<const Hypothesis> hypotheses) {
  // Relative to the largest, for the sum of the weights themselves may be infinite.
  double largest = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    largest = std::max(largest, hypothesis.weight);
  }
  double total = 0.0;
  for (const Hypothesis& hypothesis : hypotheses) {
    total += hypothesis.weight / largest;
  }
  return std::log(largest) + std::log(total);
}

std::vector<double> log_weights(std::span<const Hypothesis> hypotheses) {
  const double log_total = log_total_weight(hypotheses);
  std::vector<double> logs;
  for (const Hypothesis& hypothesis : hypotheses) {
    logs.push_back(std::log(hypothesis.weight) - log_total);
  }
  return logs;
}

std::vector<double> normalised(std::vector<double> logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double total = 0.0;
  for (double& p : logs) {
    p = std::exp(p - most);
    total += p;
  }
  for (double& p : logs) {
    p /= total;
  }
  return logs;
}

}  // namespace palpate
