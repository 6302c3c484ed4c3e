#include "hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

// Sums of this many nats over any number of touches stay within float32.
constexpr float most_log_odds = 1e30F;

}  // namespace

void validate_hypotheses(std::span<const Hypothesis> hypotheses) {
  if (hypotheses.empty()) {
    throw Error(Fault::input, "no objects: give at least one map");
  }
  for (const auto& [map, weight] : hypotheses) {
    if (map.nx < 1 || map.ny < 1 ||
        map.log_odds.size() != static_cast<std::size_t>(map.nx) * map.ny) {
      throw Error(Fault::input, fmt::format("map '{}': {} x {} cells but {} log odds", map.label,
                                            map.nx, map.ny, map.log_odds.size()));
    }
    if (!(map.cell_mm > 0.0) || !std::isfinite(map.cell_mm)) {
      throw Error(Fault::input, fmt::format("map '{}': cell_mm = {}: give a positive length",
                                            map.label, map.cell_mm));
    }
    if (map.spread_mm && (!(*map.spread_mm > 0.0) || !std::isfinite(*map.spread_mm))) {
      throw Error(Fault::input,
                  fmt::format("map '{}': spread_mm = {}: give a positive length, or none",
                              map.label, *map.spread_mm));
    }
    if (!std::isfinite(map.origin_mm.x) || !std::isfinite(map.origin_mm.y)) {
      throw Error(Fault::input, fmt::format("map '{}': origin_mm = {},{}: give finite numbers",
                                            map.label, map.origin_mm.x, map.origin_mm.y));
    }
    if (!std::all_of(map.log_odds.begin(), map.log_odds.end(),
                     [](float l) { return std::abs(l) <= most_log_odds; })) {
      throw Error(Fault::input,
                  fmt::format("map '{}': log odds must be finite and within +-{:g}; build it anew",
                              map.label, most_log_odds));
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

}  // namespace palpate
