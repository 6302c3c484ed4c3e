#include "learning/predictive_map.hpp"

#include <cmath>
#include <cstdint>

#include <glm/common.hpp>

#include "model/bounding_box.hpp"

namespace palpate {

PredictiveMap::PredictiveMap(std::span<const Touch> touches, const MapOptions& options)
    : options_(options) {
  contact_.prior = options.sensor.prior;
  BoundingBox box;
  for (const Touch& touch : touches) {
    Touch in_sensor_frame = touch;
    in_sensor_frame.T_robot_sensor = {};
    Part& part = touches_.emplace_back();
    part.known = known_readings(in_sensor_frame, options.classifier);
    for (const ElementReading& element : part.known) {
      box.take_in(touch.T_robot_sensor * element.position_mm);
    }
  }
  constexpr double tolerance = 1e-3;  // nats
  constexpr int nodes = 1024;         // increments between them are linear within 1e-4 nats
  radius_mm_ = options.sensor.support_radius_mm(1, tolerance);
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (int node = 0; node <= nodes + 1; ++node) {
      increments_[is_contact(reading) ? 1 : 0].push_back(
          options.sensor.increment(reading, radius_mm_ * std::sqrt(node / double{nodes})));
    }
  }
  if (!box.empty()) {
    cells_ = cover(box.lower, box.upper, radius_mm_, options.cell_mm);
  }
  log_odds_.assign(static_cast<std::size_t>(cells_.nx * cells_.ny),
                   log_odds_from_probability(options.sensor.prior));
  for (std::size_t i = 0; i < touches.size(); ++i) {
    put_in(i, touches[i].T_robot_sensor);
  }
}

void PredictiveMap::take_out(std::size_t touch) {
  for (const auto& [cell, increment] : touches_[touch].added) {
    log_odds_[cell] -= increment;
  }
  touches_[touch].added.clear();
}

void PredictiveMap::put_in(std::size_t touch, const Pose& T_robot_sensor) {
  Part& part = touches_[touch];
  for (const ElementReading& element : part.known) {
    visit_near(cells_, options_.cell_mm, T_robot_sensor * element.position_mm, radius_mm_,
               [&](std::size_t cell, double squared) {
                 const double nats = increment(element.reading, squared);
                 log_odds_[cell] += nats;
                 part.added.emplace_back(cell, nats);
               });
  }
}

double PredictiveMap::increment(Reading reading, double squared_mm) const {
  const std::vector<double>& of_class = increments_[is_contact(reading) ? 1 : 0];
  const double place =
      squared_mm / (radius_mm_ * radius_mm_) * static_cast<double>(of_class.size() - 2);
  const auto node = static_cast<std::size_t>(place);
  return std::lerp(of_class[node], of_class[node + 1], place - static_cast<double>(node));
}

double PredictiveMap::log_likelihood(std::size_t touch, const Pose& T_robot_sensor) const {
  // The axes of all elements; rotating each would take the sine and cosine anew.
  const glm::dvec2 x = rotate(T_robot_sensor.theta_rad, {1.0, 0.0});
  const glm::dvec2 y{-x.y, x.x};
  double sum = 0.0;
  for (const ElementReading& element : touches_[touch].known) {
    const glm::dvec2 p =
        T_robot_sensor.translation_mm + element.position_mm.x * x + element.position_mm.y * y;
    sum += contact_.log_likelihood(element.reading, {log_odds(p)});
  }
  return sum;
}

double PredictiveMap::log_odds(const glm::dvec2& p_robot_mm) const {
  const glm::dvec2 place = p_robot_mm / options_.cell_mm;
  const glm::dvec2 whole = glm::floor(place);
  const auto i = static_cast<std::int64_t>(whole.x);
  const auto j = static_cast<std::int64_t>(whole.y);
  if (!cells_.contains({i, j, 2, 2})) {
    return log_odds_from_probability(options_.sensor.prior);
  }
  const double* low = &log_odds_[cells_.index(i, j)];
  const double* high = low + cells_.nx;
  const glm::dvec2 f = place - whole;
  return std::lerp(std::lerp(low[0], low[1], f.x), std::lerp(high[0], high[1], f.x), f.y);
}

}  // namespace palpate
