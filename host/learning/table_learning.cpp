#include "learning/table_learning.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "learning/local_search.hpp"
#include "learning/progress.hpp"
#include "model/bounding_box.hpp"
#include "model/map_likelihood.hpp"
#include "model/refuse.hpp"

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

/// The presses to place on each map, [map][press]. Each press is placed on maps of its object that
/// it is no part of, `most` at most, and all maps are used about equally often.
std::vector<std::vector<std::size_t>> presses_by_map(const std::vector<Press>& presses,
                                                     const std::vector<TrainingMap>& maps,
                                                     std::size_t limit) {
  std::map<std::string, std::vector<std::size_t>> maps_of;
  for (std::size_t map = 0; map < maps.size(); ++map) {
    maps_of[maps[map].map.label].push_back(map);
  }
  std::vector<std::vector<std::size_t>> presses_of(maps.size());
  std::map<std::string, std::size_t> placed_of;
  for (std::size_t press = 0; press < presses.size(); ++press) {
    const auto own = maps_of.find(presses[press].label);
    if (own == maps_of.end()) {
      continue;
    }
    const std::size_t first = placed_of[presses[press].label]++;
    std::size_t used = 0;
    for (std::size_t k = 1; k <= own->second.size() && used < limit; ++k) {
      const std::size_t map = own->second[(first + k) % own->second.size()];
      if (!maps[map].holds(press)) {
        presses_of[map].push_back(press);
        ++used;
      }
    }
  }
  return presses_of;
}

/// Places presses on maps of their objects. Takes all host threads.
/// @param evidence of the presses, [press][touch]
std::vector<OwnPlacement> place_all(const std::vector<Press>& presses,
                                    const std::vector<std::vector<TouchEvidence>>& evidence,
                                    const std::vector<TrainingMap>& maps,
                                    const std::vector<OccupancyGrid>& layers,
                                    const TableLearning& settings, const LearnedTable& table,
                                    Progress& progress) {
  const auto presses_of = presses_by_map(presses, maps, settings.most_maps);
  std::vector<std::vector<OwnPlacement>> on_map(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(), [&](std::size_t map) {
    std::optional<PressPlacer> placer;
    const Hypothesis hypothesis{.map = maps[map].map, .layer = layers[map]};
    for (const std::size_t press : presses_of[map]) {
      PressPlacement placement;
      if (presses[press].T_object_robot) {
        placement.T_object_robot = *presses[press].T_object_robot;
      } else {
        if (!placer) {
          placer.emplace(hypothesis, contact_with(settings.contact, table, hypothesis.map.label),
                         settings.lattice);
        }
        placement = placer->place(evidence[press]);
      }
      on_map[map].push_back({press, map, placement});
    }
    progress.add();
  });
  std::vector<OwnPlacement> placements;
  for (const std::vector<OwnPlacement>& own : on_map) {
    placements.insert(placements.end(), own.begin(), own.end());
  }
  return placements;
}

/// The box around the places of an object's arrays, by label.
std::map<std::string, BoundingBox> boxes_of(const std::vector<Press>& presses) {
  std::map<std::string, BoundingBox> boxes;
  for (const Press& press : presses) {
    if (press.T_object_robot) {
      boxes[press.label].take_in(press.T_object_robot->translation_mm);
    }
  }
  return boxes;
}

/// Where a press at a known pose is counted: at poses as far from it as the nearest bin may be. The
/// bin that is nearest in theta turns all touches of an object at once, and its x and y make up for
/// the turn in the middle of the touches, so that the turn is about that point.
std::vector<Pose> counted_at(const Pose& T_object_robot, const glm::dvec2& middle_mm,
                             const BinSteps& steps) {
  const auto offsets = [](double step) {
    return step > 0.0 ? std::vector{-step / 3.0, 0.0, step / 3.0} : std::vector{0.0};
  };
  const glm::dvec2 from_middle_mm = T_object_robot.translation_mm - middle_mm;
  std::vector<Pose> poses;
  for (const double turn_rad : offsets(steps.theta_rad)) {
    const glm::dvec2 turned_mm = middle_mm + rotate(turn_rad, from_middle_mm);
    for (const double x_mm : offsets(steps.x_mm)) {
      for (const double y_mm : offsets(steps.y_mm)) {
        poses.push_back({turned_mm + glm::dvec2(x_mm, y_mm), T_object_robot.theta_rad + turn_rad});
      }
    }
  }
  return poses;
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

double fit_gamma(const LevelCounts& counts, double prior) {
  const auto loss = [&](double gamma) {
    double nats = 0.0;
    for (int node = 0; node < ReadingLayer::nodes; ++node) {
      const double value = LevelCounts::value_at(node);
      if (value >= -ReadingLayer::largest_value) {
        const double p = probability_from_log_odds(value);
        // Eq. 7's two values sum to less than 1.
        nats += counts.at(0, node) * std::log(gamma * prior + (1.0 - gamma) * (1.0 - p)) +
                counts.at(1, node) * std::log(gamma * prior + (1.0 - gamma) * p) -
                counts.at_node(node) * std::log(1.0 - gamma * (1.0 - 2.0 * prior));
      }
    }
    return -nats;
  };
  constexpr double least = 1e-3;
  constexpr double limit = 0.9;
  return least_at(least, limit, 1e-4, loss);
}

ReadingLayer mean_level_layer(double threshold, double full_level) {
  constexpr double least_full = 3.0;  // in thresholds; the unit is then one threshold
  if (!(threshold > 0.0 && std::isfinite(threshold))) {
    refuse(fmt::format("threshold = {}", threshold), "a layer of mean levels needs one above 0");
  }
  const double full = std::max(full_level, least_full * threshold);
  return {.of = MapLayer::mean_level,
          .unit_level = threshold * threshold / (full - 2.0 * threshold),
          .full_level = full};
}

LearnedTable TableLearning::initial() const {
  LearnedTable table{.layer = layer, .level_edges = level_edges};
  table.shared = initial_table(layer, table.levels(), contact);
  return table;
}

ContactModel TableLearning::classifier() const { return contact_with(contact, initial(), ""); }

LearnedTable table_of(const ObjectCounts& counts, const TableLearning& settings) {
  LearnedTable table = settings.initial();
  LevelCounts all(table.levels());
  for (const auto& [label, own] : counts) {
    all += own;
  }
  table.shared = shrunk_table(all, table.shared, settings.shared_pseudo_counts);
  for (const auto& [label, own] : counts) {
    table.objects[label] = shrunk_table(own, table.shared, settings.object_pseudo_counts);
  }
  return table;
}

LikelihoodTable table_for(const LearnedTable& table, const std::string& label) {
  const auto own = table.objects.find(label);
  return table_of(table, own == table.objects.end() ? table.shared : own->second);
}

ContactModel contact_with(const ContactModel& contact, const LearnedTable& table,
                          const std::string& label) {
  ContactModel model = contact;
  model.table = table_for(table, label);
  model.prior = probability_from_log_odds(ReadingLayer::beyond);
  return model;
}

std::vector<OccupancyGrid> layers_of(const std::vector<TrainingMap>& maps,
                                     const ReadingLayer& layer) {
  std::vector<OccupancyGrid> layers(maps.size());
  tbb::parallel_for(std::size_t{0}, maps.size(),
                    [&](std::size_t i) { layers[i] = reading_layer(maps[i].map, layer); });
  return layers;
}

PlacedPresses learn_table(const std::vector<Press>& presses, const std::vector<TrainingMap>& maps,
                          const TableLearning& settings,
                          const std::function<void(double)>& progress) {
  const std::vector<OccupancyGrid> layers = layers_of(maps, settings.layer);
  const ContactModel classifier = settings.classifier();
  std::vector<std::vector<TouchEvidence>> evidence;
  for (const Press& press : presses) {
    evidence.push_back(evidence_of(press.touches, classifier));
  }
  const int rounds = at_known_poses(presses) ? 1 : settings.rounds;
  PlacedPresses placed{.placements = {}, .table = settings.initial()};
  Progress counter(static_cast<double>(maps.size()) * rounds, progress);
  for (int round = 0; round < rounds; ++round) {
    placed.placements = place_all(presses, evidence, maps, layers, settings, placed.table, counter);
    if (placed.placements.empty()) {
      refuse("likelihood table",
             "none of {} touches can be compared with other touches of its object; give at least "
             "two touches of one object, of two groups with `group`, or a map of it",
             presses.size());
    }
    placed.table = table_of(count_placed(placed.placements, presses, layers, settings), settings);
  }
  return placed;
}

ObjectCounts count_placed(std::span<const OwnPlacement> placements,
                          const std::vector<Press>& presses,
                          const std::vector<OccupancyGrid>& layers, const TableLearning& settings) {
  std::vector<std::vector<const OwnPlacement*>> of_press(presses.size());
  for (const OwnPlacement& placement : placements) {
    of_press[placement.press].push_back(&placement);
  }
  const ContactModel classifier = settings.classifier();
  const std::map<std::string, BoundingBox> boxes = boxes_of(presses);
  ObjectCounts counts;
  for (std::size_t press = 0; press < presses.size(); ++press) {
    std::vector<const OwnPlacement*>& on = of_press[press];
    std::ranges::stable_sort(on, [](const OwnPlacement* a, const OwnPlacement* b) {
      return a->placement.log_likelihood > b->placement.log_likelihood;
    });
    on.resize(std::min(on.size(), settings.best_maps));
    const std::vector<TouchEvidence> evidence = evidence_of(presses[press].touches, classifier);
    for (const OwnPlacement* placement : on) {
      const std::vector<Pose> poses =
          presses[press].T_object_robot
              ? counted_at(*presses[press].T_object_robot, boxes.at(presses[press].label).middle(),
                           settings.counted_within)
              : std::vector{placement->placement.T_object_robot};
      counts.try_emplace(presses[press].label, settings.level_edges.size() + 2)
          .first->second.add(evidence, poses, layers[placement->map]);
    }
  }
  return counts;
}

}  // namespace palpate
