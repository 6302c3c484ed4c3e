#include "model/map_likelihood.hpp"

#include <cmath>

namespace palpate {

namespace {

/// T_object_sensor of elements, with the sine and the cosine worked out once.
class SensorAxes {
 public:
  explicit SensorAxes(const Pose& T_object_sensor)
      : origin_mm_(T_object_sensor.translation_mm),
        along_x_(rotate(T_object_sensor.theta_rad, {1.0, 0.0})),
        along_y_(rotate(T_object_sensor.theta_rad, {0.0, 1.0})) {}

  glm::dvec2 operator*(const glm::dvec2& element_mm) const {
    return origin_mm_ + element_mm.x * along_x_ + element_mm.y * along_y_;
  }

 private:
  glm::dvec2 origin_mm_;
  glm::dvec2 along_x_;
  glm::dvec2 along_y_;
};

}  // namespace

MapLikelihood::MapLikelihood(const OccupancyGrid& map, const ContactModel& contact,
                             std::size_t object)
    : map_(map, contact.prior.value_or(map.prior)),
      eq7_{.classifier = contact.classifier,
           .gamma = contact.gamma,
           .prior = contact.prior.value_or(map.prior)} {
  if (const auto& table = contact.table) {
    contact.log_likelihood(Reading::no_contact, {}, object);  // throws where it has no numbers
    levels_ = table->levels();
    nodes_ = table->nodes;
    last_node_ = static_cast<double>(nodes_ - 1);
    first_log_odds_ = table->first_log_odds;
    nodes_per_nat_ = nodes_per_nat(*table);
    sets_ = table->sets();
    object_ = object;
    const double* const first = numbers_of(*table, Reading::no_contact, object).data();
    nats_.assign(first, first + levels_ * nodes_);
  }
}

double MapLikelihood::at(const TouchEvidence& touch, const Pose& T_object_sensor) const {
  const SensorAxes axes(T_object_sensor);
  double sum = 0.0;
  for (std::size_t e = 0; e < touch.readings.size(); ++e) {
    if (touch.readings[e] != Reading::unknown) {
      require(touch.readings[e]);
      sum += at(touch.readings[e], axes * touch.elements_mm[e]);
    }
  }
  return sum;
}

double MapLikelihood::at(std::span<const TouchEvidence> touches, const Pose& T_object_robot) const {
  double sum = 0.0;
  for (const TouchEvidence& touch : touches) {
    sum += at(touch, T_object_robot * touch.T_robot_sensor);
  }
  return sum;
}

void MapLikelihood::all_readings(std::span<const glm::dvec2> elements_mm,
                                 const Pose& T_object_sensor, std::span<double> logs) const {
  const SensorAxes axes(T_object_sensor);
  const double floor = eq7_.gamma * *eq7_.prior;
  const double share = 1.0 - eq7_.gamma;
  auto out = logs.begin();
  for (const glm::dvec2& element : elements_mm) {
    const double l = log_odds(axes * element);
    if (nats_.empty() && eq7_.gamma > 0.0) {
      // Both readings in a third of the time of ContactModel::log_likelihood(): gamma m keeps the
      // arguments of the logarithms away from 0, and exp() never overflows.
      const double less = std::exp(-std::abs(l));
      const double more_likely = std::log(floor + share / (1.0 + less));
      const double less_likely = std::log(floor + share * less / (1.0 + less));
      *out++ = l > 0.0 ? less_likely : more_likely;
      *out++ = l > 0.0 ? more_likely : less_likely;
      continue;
    }
    for (std::size_t level = 0; level < levels_; ++level) {
      *out++ = of(static_cast<Reading>(level), l);
    }
  }
}

}  // namespace palpate
