#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The living elements of one touch, and what they read.
struct LivingElements {
  struct Element {
    glm::dvec2 p_sensor_mm;
    std::size_t reading = 0;  ///< class of ReadingModel
  };

  LivingElements(const Touch& touch, const ContactModel& contact);

  Pose T_robot_sensor;
  std::vector<Element> elements;
};

/// Log odds of the cells that SmoothOccupancy holds to be occupied to this degree, from 0 to 1.
double log_odds_of_occupancy(double occupancy);

/// How much of the surface about a place is occupied, from 0 to 1: 1 / (1 + exp(-(l - 4) / 2)) of a
/// map's log odds l, blurred by a Gaussian of 1.4 times the sensor model's spread. Readings depend
/// on it alike everywhere on an object, while the log odds also grow with the number of touches
/// that the map was built from; a touch's evidence by the log odds is displaced by 0.15 mm, by the
/// smooth occupancy by 0.05 mm.
class SmoothOccupancy {
 public:
  /// @param contact with a prior
  SmoothOccupancy(const OccupancyGrid& map, const ContactModel& contact);

  /// Calls visit(element, occupancy at it) for every element of the touch, its sensor at
  /// T_object_sensor.
  template <typename Visit>
  void sample(const LivingElements& touch, const Pose& T_object_sensor, const Visit& visit) const;

 private:
  glm::dvec2 first_mm_;  ///< centre of the border's first cell
  double cell_mm_;
  int columns_;  ///< border included
  int rows_;
  std::vector<float> occupancy_;  ///< [rows, columns]
};

template <typename Visit>
void SmoothOccupancy::sample(const LivingElements& touch, const Pose& T_object_sensor,
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
    const float* cell = &occupancy_[static_cast<std::size_t>(j) * columns_ + i];
    const double lower = cell[0] + (column - i) * (cell[1] - cell[0]);
    const double upper = cell[columns_] + (column - i) * (cell[columns_ + 1] - cell[columns_]);
    visit(element, lower + (row - j) * (upper - lower));
  }
}

/// How often a living element reads each class at a place of given smooth occupancy (see
/// SmoothOccupancy): No Contact, every level of In Contact, and Unknown. Learned from the touches
/// themselves: probabilities at nodes, linear between them. Eq. 7 leaves Unknown out, though that
/// is what elements at an object's edge read; under it the largest evidence is at standard
/// deviations that are too small.
class ReadingModel {
 public:
  /// Starts with the contact model's likelihoods, normalised, and Unknown as likely everywhere.
  /// @param contact with a prior
  explicit ReadingModel(const ContactModel& contact);

  std::size_t classes() const { return classes_; }
  /// Log-probability of a class, which is below classes(), in nats.
  /// @param occupancy from 0 to 1
  double log_probability(std::size_t reading, double occupancy) const {
    const auto part = static_cast<std::size_t>(occupancy * static_cast<double>(parts_));
    return log_p_[reading * parts_ + (part < parts_ ? part : parts_ - 1)];
  }

  /// Expected numbers of readings, [class, node].
  using Counts = std::vector<double>;
  Counts no_counts() const { return Counts(classes_ * nodes_); }
  void count(Counts& counts, std::size_t reading, double occupancy, double weight) const;
  /// Takes the relative frequencies, with what it started with as a few readings more at each node.
  void learn(const Counts& counts);

 private:
  void tabulate(const std::vector<double>& probability);

  static constexpr std::size_t nodes_ = 33;
  static constexpr std::size_t parts_ = 2048;
  std::size_t classes_;        ///< Unknown is the last
  std::vector<double> start_;  ///< probabilities, [class, node]
  std::vector<float> log_p_;   ///< [class, part of the occupancy], at the middle of each part
};

}  // namespace palpate
