#include "palpate/contact_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

namespace {

bool is_alive(const Touch& touch, std::size_t element) {
  return touch.valid.empty() || touch.valid[element] != 0;
}

void require_sound(const Touch& touch) {
  const std::size_t e = touch.pressure.size();
  if (touch.elements_mm.size() != e || (!touch.valid.empty() && touch.valid.size() != e)) {
    throw Error(Fault::input,
                fmt::format("touch: {} pressures, {} elements and {} validities; make them agree",
                            e, touch.elements_mm.size(), touch.valid.size()));
  }
  const auto finite = [](const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); };
  if (!finite(touch.T_robot_sensor.translation_mm) ||
      !std::isfinite(touch.T_robot_sensor.theta_rad)) {
    throw Error(Fault::input, "touch: T_robot_sensor is not finite; give finite numbers");
  }
  for (std::size_t i = 0; i < e; ++i) {
    if (!finite(touch.elements_mm[i]) || (is_alive(touch, i) && std::isinf(touch.pressure[i]))) {
      throw Error(Fault::input,
                  fmt::format("touch: element {}: its place or pressure is not finite; mark a dead "
                              "element as not valid",
                              i));
    }
  }
}

/// log(1 / (1 + exp(-l))), exact where the logistic function itself would underflow.
double log_logistic(double l) { return std::min(l, 0.0) - std::log1p(std::exp(-std::abs(l))); }

/// log(exp(a) + exp(b))
double log_sum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

/// Linear between the nodes of one level, constant beyond them.
double interpolate(const LikelihoodTable& table, Reading level, double log_odds,
                   std::size_t object) {
  const std::span<const double> nats = numbers_of(table, level, object);
  const double last = static_cast<double>(table.nodes - 1);
  const double place = std::clamp(
      (log_odds - table.first_log_odds) * last / (table.last_log_odds - table.first_log_odds), 0.0,
      last);
  const auto node = std::min(static_cast<std::size_t>(place), table.nodes - 2);
  return std::lerp(nats[node], nats[node + 1], place - static_cast<double>(node));
}

/// The model's log-likelihoods at nodes of its own.
LikelihoodTable sampled(const ContactModel& contact) {
  LikelihoodTable table{.first_log_odds = -16.0,
                        .last_log_odds = 16.0,
                        .nodes = 1025,
                        .level_edges = {},
                        .log_likelihood = {}};
  std::size_t sets = 1;
  if (contact.table) {
    table.level_edges = contact.table->level_edges;
    sets = contact.table->sets();
  }
  const double last = static_cast<double>(table.nodes - 1);
  for (std::size_t set = 0; set < sets; ++set) {
    for (std::size_t level = 0; level < table.levels(); ++level) {
      for (std::size_t node = 0; node < table.nodes; ++node) {
        const double value =
            std::lerp(table.first_log_odds, table.last_log_odds, static_cast<double>(node) / last);
        table.log_likelihood.push_back(
            contact.log_likelihood(static_cast<Reading>(level), {.log_odds = value}, set));
      }
    }
  }
  return table;
}

[[noreturn]] void refuse_table(const std::string& fault) {
  throw Error(Fault::input, "likelihood table: " + fault);
}

}  // namespace

void ContactClassifier::validate() const {
  if (!(threshold >= 0.0) || !std::isfinite(threshold)) {
    throw Error(Fault::input, fmt::format("threshold = {}: give a pressure of at least 0, in the "
                                          "recording's unit",
                                          threshold));
  }
  if (!(ratio >= 0.0 && ratio < 1.0)) {
    throw Error(Fault::input, fmt::format("ratio = {}: must be at least 0 and below 1", ratio));
  }
}

std::vector<Reading> ContactClassifier::classify(const Touch& touch) const {
  return palpate::classify(touch, {.classifier = *this}, {});
}

std::vector<ElementReading> known_readings(const Touch& touch,
                                           const ContactClassifier& classifier) {
  const std::vector<Reading> readings = classifier.classify(touch);
  std::vector<ElementReading> known;
  known.reserve(readings.size());
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (readings[i] != Reading::unknown) {
      known.push_back({touch.T_robot_sensor * touch.elements_mm[i], readings[i]});
    }
  }
  return known;
}

std::optional<std::string> fault_of(std::span<const ElementReading> readings) {
  for (const ElementReading& reading : readings) {
    const glm::dvec2& p = reading.position_mm;
    if (!(std::abs(p.x) <= farthest_mm && std::abs(p.y) <= farthest_mm)) {
      return fmt::format(
          "an element at [{}, {}] mm; keep touches within {:g} mm of the robot "
          "frame's origin, or check the poses' unit",
          p.x, p.y, farthest_mm);
    }
  }
  return {};
}

void LikelihoodTable::validate() const {
  constexpr double farthest = 1000.0;
  constexpr double least_step = 0.001;
  if (nodes < 2) {
    refuse_table(fmt::format("nodes = {}: give at least 2", nodes));
  }
  if (!(std::abs(first_log_odds) <= farthest && std::abs(last_log_odds) <= farthest &&
        last_log_odds - first_log_odds >= least_step * static_cast<double>(nodes - 1))) {
    refuse_table(
        fmt::format("{} nodes from log odds {} to {}: give ascending ones within +-{} "
                    "nats, at least {} apart",
                    nodes, first_log_odds, last_log_odds, farthest, least_step));
  }
  if (levels() > most_reading_levels) {
    refuse_table(fmt::format("level_edges: {} of them make {} levels, more than {}; give fewer",
                             level_edges.size(), levels(), most_reading_levels));
  }
  for (std::size_t i = 0; i < level_edges.size(); ++i) {
    if (!std::isfinite(level_edges[i]) || (i > 0 && !(level_edges[i] > level_edges[i - 1]))) {
      refuse_table(
          fmt::format("level_edges[{}] = {}: give finite, ascending pressures", i, level_edges[i]));
    }
  }
  const std::size_t of_a_set = levels() * nodes;
  if (log_likelihood.empty() || log_likelihood.size() % of_a_set != 0) {
    refuse_table(fmt::format("log_likelihood: {} numbers are no multiple of {} levels x {} nodes",
                             log_likelihood.size(), levels(), nodes));
  }
  for (std::size_t i = 0; i < log_likelihood.size(); ++i) {
    if (!(std::abs(log_likelihood[i]) <= most_log_odds)) {
      refuse_table(fmt::format("log_likelihood[{}, {}, {}] = {}: give nats within +-{:g}",
                               i / of_a_set, i % of_a_set / nodes, i % nodes, log_likelihood[i],
                               most_log_odds));
    }
  }
}

void ContactModel::validate() const {
  classifier.validate();
  if (!(gamma >= 0.0 && gamma < 1.0)) {
    throw Error(Fault::input, fmt::format("gamma = {}: must lie in [0, 1)", gamma));
  }
  if (prior && !(*prior > 0.0 && *prior < 1.0)) {
    throw Error(Fault::input, fmt::format("prior = {}: must lie strictly between 0 and 1", *prior));
  }
  if (table) {
    table->validate();
  }
}

std::vector<Reading> ContactModel::classify(const Touch& touch) const {
  return palpate::classify(touch, *this, {});
}

std::vector<Reading> classify(const Touch& touch, const ContactModel& model,
                              std::vector<Reading> reuse) {
  model.classifier.validate();
  require_sound(touch);
  const auto& [threshold, ratio] = model.classifier;
  const std::size_t e = touch.pressure.size();
  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < e; ++i) {
    if (is_alive(touch, i)) {
      largest = std::max(largest, touch.pressure[i]);
    }
  }
  std::span<const double> edges;
  if (model.table) {
    edges = model.table->level_edges;
  }
  std::vector<Reading> readings = std::move(reuse);
  readings.assign(e, Reading::unknown);
  for (std::size_t i = 0; i < e; ++i) {
    const double pressure = touch.pressure[i];
    if (!is_alive(touch, i)) {
      continue;
    }
    if (pressure > threshold && pressure > ratio * largest) {
      const auto reached = std::ranges::upper_bound(edges, pressure);
      readings[i] = contact_level(static_cast<std::size_t>(reached - edges.begin()));
    } else if (pressure < threshold && pressure < ratio * largest) {
      readings[i] = Reading::no_contact;
    }
  }
  return readings;
}

void refuse_reading(std::size_t levels, std::size_t sets, Reading reading, std::size_t object) {
  refuse_table(
      fmt::format("it has {} levels and {} sets of numbers, none for level {} of object {}", levels,
                  sets, static_cast<int>(reading), object));
}

double ContactModel::log_likelihood(Reading reading, const MapSample& map,
                                    std::size_t object) const {
  if (reading == Reading::unknown) {
    return 0.0;
  }
  if (table) {
    const std::size_t sets = table->sets();
    if (static_cast<std::size_t>(reading) >= table->levels() || (sets > 1 && object >= sets)) {
      refuse_reading(table->levels(), sets, reading, object);
    }
    return interpolate(*table, reading, map.log_odds, object);
  }
  // Eq. 7: p is the probability of a cell that is occupied, or one that is not.
  const double log_p = log_logistic(reading == Reading::no_contact ? -map.log_odds : map.log_odds);
  if (gamma == 0.0) {
    return log_p;
  }
  return log_sum(std::log(gamma) + std::log(prior.value()), std::log1p(-gamma) + log_p);
}

ContactModel tabulated(ContactModel contact) {
  if (!contact.table) {
    contact.table = sampled(contact);
  }
  return contact;
}

ContactModel predictive(ContactModel contact) {
  LikelihoodTable table = sampled(contact);
  const std::size_t of_a_set = table.levels() * table.nodes;
  for (std::size_t set = 0; set < table.log_likelihood.size(); set += of_a_set) {
    for (std::size_t node = set; node < set + table.nodes; ++node) {
      double all = -std::numeric_limits<double>::infinity();
      for (std::size_t at = node; at < set + of_a_set; at += table.nodes) {
        all = log_sum(all, table.log_likelihood[at]);
      }
      for (std::size_t at = node; at < set + of_a_set; at += table.nodes) {
        table.log_likelihood[at] -= all;
      }
    }
  }
  contact.table = std::move(table);
  return contact;
}

}  // namespace palpate
