#include "reference/reference.hpp"

#include <algorithm>
#include <cmath>

namespace palpate::reference {

namespace {

/// log(1 / (1 + exp(-l))): the form that does not overflow on either side.
double log_logistic(double l) {
  return l >= 0.0 ? -std::log1p(std::exp(-l)) : l - std::log1p(std::exp(l));
}

/// A straight line between the nodes on either side of the log odds, flat beyond the first and
/// last.
double tabled(const LikelihoodTable& table, std::size_t level, double log_odds,
              std::size_t object) {
  const std::size_t levels = table.level_edges.size() + 2;
  const bool shared = table.log_likelihood.size() == levels * table.nodes;
  const double* nats =
      table.log_likelihood.data() + ((shared ? 0 : object) * levels + level) * table.nodes;
  const double steps = static_cast<double>(table.nodes) - 1.0;
  const double step = (table.last_log_odds - table.first_log_odds) / steps;
  if (log_odds <= table.first_log_odds) {
    return nats[0];
  }
  if (log_odds >= table.last_log_odds) {
    return nats[table.nodes - 1];
  }
  const double below = std::min(std::floor((log_odds - table.first_log_odds) / step), steps - 1.0);
  const double share = (log_odds - (table.first_log_odds + below * step)) / step;
  const auto node = static_cast<std::size_t>(below);
  return (1.0 - share) * nats[node] + share * nats[node + 1];
}

/// Eq. 7 or the table, with m = `prior`.
double of_element(Reading reading, double log_odds, const ContactModel& model, double prior,
                  std::size_t object) {
  if (reading == Reading::unknown) {
    return 0.0;
  }
  if (model.table) {
    return tabled(*model.table, static_cast<std::size_t>(reading), log_odds, object);
  }
  const double log_p = log_logistic(reading == Reading::no_contact ? -log_odds : log_odds);
  if (model.gamma == 0.0) {
    return log_p;
  }
  return std::log(model.gamma * prior + (1.0 - model.gamma) * std::exp(log_p));
}

}  // namespace

double interpolate(const OccupancyGrid& map, double prior, const glm::dvec2& p_object_mm) {
  const double x = (p_object_mm.x - map.origin_mm.x) / map.cell_mm;
  const double y = (p_object_mm.y - map.origin_mm.y) / map.cell_mm;
  const double column = std::floor(x);
  const double row = std::floor(y);
  const auto cell = [&](double i, double j) {
    const bool inside = i >= 0.0 && i < map.nx && j >= 0.0 && j < map.ny;
    return inside ? static_cast<double>(map.at(static_cast<int>(i), static_cast<int>(j)))
                  : logit(prior);
  };
  const double fx = x - column;
  const double fy = y - row;
  return (1.0 - fy) * ((1.0 - fx) * cell(column, row) + fx * cell(column + 1.0, row)) +
         fy * ((1.0 - fx) * cell(column, row + 1.0) + fx * cell(column + 1.0, row + 1.0));
}

double log_likelihood(Reading reading, const MapSample& map, const ContactModel& model,
                      std::size_t object) {
  return of_element(reading, map.log_odds, model, model.prior.value_or(0.0), object);
}

double log_likelihood(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map,
                      const ContactModel& contact, std::size_t object) {
  const double prior = contact.prior.value_or(map.prior);
  const std::vector<Reading> readings = classify(touch, contact);
  double sum = 0.0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const glm::dvec2 p_object =
        transform(T_object_robot, transform(touch.T_robot_sensor, touch.elements_mm[k]));
    sum += of_element(readings[k], interpolate(map, prior, p_object), contact, prior, object);
  }
  return sum;
}

}  // namespace palpate::reference
