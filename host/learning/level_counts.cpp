#include "learning/level_counts.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "model/interpolated_map.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr int nodes = ReadingLayer::nodes;
constexpr double node_step = LevelCounts::node_step;
/// Cells that nothing sensed have values below this one.
constexpr double least_sensed = -ReadingLayer::largest_value;

/// The value that a reading layer gives to a pressure; see ReadingLayer.
double value_of_level(double level, const ReadingLayer& layer) {
  return 2.0 * ReadingLayer::largest_value * std::log1p(level / layer.unit_level) /
             std::log1p(layer.full_level / layer.unit_level) -
         ReadingLayer::largest_value;
}

}  // namespace

LevelCounts::LevelCounts(std::size_t levels) : counts_(levels * nodes, 0.0) {}

void LevelCounts::add(Reading reading, double value, double weight) {
  if (reading == Reading::unknown) {
    return;
  }
  const double place =
      std::clamp((value - ReadingLayer::first_node) / node_step, 0.0, double{nodes - 1});
  const int node = std::min(static_cast<int>(place), nodes - 2);
  const double share = place - node;
  const std::size_t at = static_cast<std::size_t>(reading) * nodes + static_cast<std::size_t>(node);
  counts_.at(at) += (1.0 - share) * weight;
  counts_.at(at + 1) += share * weight;
}

void LevelCounts::add(std::span<const TouchEvidence> touches, std::span<const Pose> T_object_robot,
                      const OccupancyGrid& layer) {
  const InterpolatedMap values(layer, layer.prior);
  const double weight = 1.0 / static_cast<double>(T_object_robot.size());
  for (const TouchEvidence& touch : touches) {
    for (const Pose& pose : T_object_robot) {
      const Pose T_object_sensor = pose * touch.T_robot_sensor;
      for (std::size_t e = 0; e < touch.readings.size(); ++e) {
        if (touch.readings[e] != Reading::unknown) {
          add(touch.readings[e], values.log_odds(T_object_sensor * touch.elements_mm[e]), weight);
        }
      }
    }
  }
}

LevelCounts& LevelCounts::operator+=(const LevelCounts& other) {
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    counts_[i] += other.counts_.at(i);
  }
  return *this;
}

double LevelCounts::at(std::size_t level, int node) const {
  return counts_.at(level * nodes + static_cast<std::size_t>(node));
}

double LevelCounts::at_node(int node) const {
  double sum = 0.0;
  for (std::size_t level = 0; level < levels(); ++level) {
    sum += at(level, node);
  }
  return sum;
}

double LevelCounts::total() const { return std::accumulate(counts_.begin(), counts_.end(), 0.0); }

std::vector<double> initial_table(const ReadingLayer& layer, std::size_t levels,
                                  const ContactModel& contact) {
  ContactModel eq7 = contact;
  eq7.table.reset();
  const double threshold_value =
      layer.of == MapLayer::mean_level ? value_of_level(eq7.classifier.threshold, layer) : 0.0;
  const double contacts = static_cast<double>(levels - 1);
  std::vector<double> table(levels * nodes);
  for (int node = 0; node < nodes; ++node) {
    const double value = LevelCounts::value_at(node);
    const MapSample sample{.log_odds = value < least_sensed
                                           ? log_odds_from_probability(eq7.prior.value())
                                           : value - threshold_value};
    const double none = std::exp(eq7.log_likelihood(Reading::no_contact, sample));
    const double contact_here = std::exp(eq7.log_likelihood(Reading::in_contact, sample));
    const double sum = none + contact_here;
    for (std::size_t level = 0; level < levels; ++level) {
      const double p = level == 0 ? none / sum : contact_here / (sum * contacts);
      table[level * nodes + static_cast<std::size_t>(node)] = std::log(p);
    }
  }
  return table;
}

std::vector<double> shrunk_table(const LevelCounts& counts, std::span<const double> towards,
                                 double pseudo_counts) {
  constexpr double least_probability = 1e-6;
  std::vector<double> table(counts.levels() * nodes);
  for (int node = 0; node < nodes; ++node) {
    const auto index = [&](std::size_t level) {
      return level * nodes + static_cast<std::size_t>(node);
    };
    double sum = 0.0;
    for (std::size_t level = 0; level < counts.levels(); ++level) {
      sum += std::exp(towards[index(level)]);
    }
    const double all = counts.at_node(node) + pseudo_counts;
    for (std::size_t level = 0; level < counts.levels(); ++level) {
      const double expected = pseudo_counts * std::exp(towards[index(level)]) / sum;
      table[index(level)] =
          std::log(std::max((counts.at(level, node) + expected) / all, least_probability));
    }
  }
  return table;
}

ReadingLayer mean_level_layer(double threshold, double full_level) {
  constexpr double least_full = 3.0;  // in thresholds; the unit is then one threshold
  if (!(threshold > 0.0 && std::isfinite(threshold))) {
    throw Error(Fault::input,
                fmt::format("threshold = {}: a layer of mean levels needs one above 0", threshold));
  }
  const double full = std::max(full_level, least_full * threshold);
  return {.of = MapLayer::mean_level,
          .unit_level = threshold * threshold / (full - 2.0 * threshold),
          .full_level = full};
}

}  // namespace palpate
