#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"
#include "reading_model.hpp"

namespace palpate {

/// The living elements of one touch, and what they read.
struct LivingElements {
  struct Element {
    glm::dvec2 p_sensor_mm;
    std::size_t reading = 0;  ///< class of ReadingModel
  };

  LivingElements(const Touch& touch, const ContactModel& contact);

  Pose T_robot_sensor;
  double largest = 0.0;  ///< pressure
  std::vector<Element> elements;
};

/// A map that is read fast at many places: it has a border of prior cells.
class BorderedLogOdds {
 public:
  /// @param contact with a prior
  BorderedLogOdds(const OccupancyGrid& map, const ContactModel& contact);

  /// Calls visit(element, log odds at it) for every element of the touch, its sensor at
  /// T_object_sensor.
  template <typename Visit>
  void sample(const LivingElements& touch, const Pose& T_object_sensor, const Visit& visit) const;

 private:
  glm::dvec2 first_mm_;  ///< centre of the border's first cell
  double cell_mm_;
  int columns_;  ///< border included
  int rows_;
  std::vector<float> log_odds_;  ///< [rows, columns]
};

template <typename Visit>
void BorderedLogOdds::sample(const LivingElements& touch, const Pose& T_object_sensor,
                             const Visit& visit) const {
  const glm::dvec2 x_step = rotate(T_object_sensor.theta_rad, {1.0 / cell_mm_, 0.0});
  const glm::dvec2 origin = (T_object_sensor.translation_mm - first_mm_) / cell_mm_;
  // The last cell belongs to the interpolation that begins one cell before it.
  const double last_column = columns_ - 1 - 1e-9;
  const double last_row = rows_ - 1 - 1e-9;
  const auto within = [](double value, double last) {
    return value < 0.0 ? 0.0 : value > last ? last : value;
  };
  for (const LivingElements::Element& element : touch.elements) {
    const glm::dvec2& p = element.p_sensor_mm;
    const double column = within(origin.x + x_step.x * p.x - x_step.y * p.y, last_column);
    const double row = within(origin.y + x_step.y * p.x + x_step.x * p.y, last_row);
    const int i = static_cast<int>(column);
    const int j = static_cast<int>(row);
    const float* cell = &log_odds_[static_cast<std::size_t>(j) * columns_ + i];
    const double lower = cell[0] + (column - i) * (cell[1] - cell[0]);
    const double upper = cell[columns_] + (column - i) * (cell[columns_ + 1] - cell[columns_]);
    visit(element, lower + (row - j) * (upper - lower));
  }
}

}  // namespace palpate
