#include "reference.hpp"

#include <cmath>

namespace palpate::reference {

namespace {

/// log(1 / (1 + exp(-l))): the form that does not overflow on either side.
double log_logistic(double l) {
  return l >= 0.0 ? -std::log1p(std::exp(-l)) : l - std::log1p(std::exp(l));
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

double log_likelihood(Reading reading, double log_odds, const ContactLikelihood& model) {
  if (reading == Reading::unknown) {
    return 0.0;
  }
  const double log_p = log_logistic(reading == Reading::in_contact ? log_odds : -log_odds);
  if (model.gamma == 0.0) {
    return log_p;
  }
  return std::log(model.gamma * model.prior + (1.0 - model.gamma) * std::exp(log_p));
}

double log_likelihood(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map,
                      const ContactClassifier& classifier, const ContactLikelihood& model) {
  const std::vector<Reading> readings = classify(touch, classifier);
  double sum = 0.0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const glm::dvec2 p_object =
        transform(T_object_robot, transform(touch.T_robot_sensor, touch.elements_mm[k]));
    sum += log_likelihood(readings[k], interpolate(map, model.prior, p_object), model);
  }
  return sum;
}

}  // namespace palpate::reference
