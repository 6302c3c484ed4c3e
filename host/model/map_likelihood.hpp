#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// A map's log odds, interpolated bilinearly; every cell beyond the map holds the prior's.
class InterpolatedMap {
 public:
  /// @param map outlives this object
  InterpolatedMap(const OccupancyGrid& map, double prior)
      : map_(map), beyond_(log_odds_from_probability(prior)) {}

  double log_odds(const glm::dvec2& p_object_mm) const {
    const glm::dvec2 place = (p_object_mm - map_.origin_mm) / map_.cell_mm;
    // In doubles: the place may lie beyond what an int holds.
    if (!(place.x >= -1.0 && place.x < map_.nx && place.y >= -1.0 && place.y < map_.ny)) {
      return beyond_;
    }
    const int i = floor_of(place.x);
    const int j = floor_of(place.y);
    const double fx = place.x - i;
    const double fy = place.y - j;
    const bool inside = i >= 0 && i + 1 < map_.nx && j >= 0 && j + 1 < map_.ny;
    if (!inside) {
      return between(between(cell(i, j), cell(i + 1, j), fx),
                     between(cell(i, j + 1), cell(i + 1, j + 1), fx), fy);
    }
    const float* lower = map_.log_odds.data() + static_cast<std::ptrdiff_t>(j) * map_.nx + i;
    const float* upper = lower + map_.nx;
    return between(between(lower[0], lower[1], fx), between(upper[0], upper[1], fx), fy);
  }

 private:
  /// std::floor() is a call where the instruction set need not have it.
  static int floor_of(double value) {
    const auto whole = static_cast<int>(value);
    return whole - static_cast<int>(value < whole);
  }
  static double between(double a, double b, double share) { return a + share * (b - a); }
  double cell(int i, int j) const {
    const bool inside = i >= 0 && i < map_.nx && j >= 0 && j < map_.ny;
    return inside ? static_cast<double>(map_.at(i, j)) : beyond_;
  }

  const OccupancyGrid& map_;
  double beyond_;
};

/// The log-likelihood of readings on one object's map (Eq. 7, or the contact model's table), in
/// nats, for many poses: what depends on neither touch nor pose is worked out once.
class MapLikelihood {
 public:
  /// @param map what readings are compared with; outlives this object
  /// @param contact sound; where it has no prior, the map's is taken
  /// @param object whose numbers of a table are read
  /// @throws Error on a table without numbers for the object
  MapLikelihood(const OccupancyGrid& map, const ContactModel& contact, std::size_t object = 0);

  /// Readings that the model tells apart, Unknown left out: No Contact and the levels of In
  /// Contact.
  std::size_t levels() const { return levels_; }

  /// The map at a place, see InterpolatedMap.
  double log_odds(const glm::dvec2& p_object_mm) const { return map_.log_odds(p_object_mm); }

  /// Of a reading where the map has these log odds. Where the model has a table, only for readings
  /// that require() lets pass.
  double of(Reading reading, double log_odds) const {
    if (nats_.empty()) {
      return eq7_.log_likelihood(reading, {log_odds});
    }
    const double place = std::clamp((log_odds - first_log_odds_) * nodes_per_nat_, 0.0, last_node_);
    const auto node = std::min(static_cast<std::size_t>(place), nodes_ - 2);
    const double* nats = nats_.data() + static_cast<std::size_t>(reading) * nodes_ + node;
    return nats[0] + (place - static_cast<double>(node)) * (nats[1] - nats[0]);
  }
  /// @throws Error where the model has a table without numbers for the reading, Unknown among them
  void require(Reading reading) const {
    if (!nats_.empty() && static_cast<std::size_t>(reading) >= levels_) {
      refuse_reading(levels_, sets_, reading, object_);
    }
  }
  /// Of a reading at a place on the object.
  double at(Reading reading, const glm::dvec2& p_object_mm) const {
    return of(reading, log_odds(p_object_mm));
  }
  /// Sum over the touch's known elements.
  /// @param T_object_sensor in the place of the touch's own pose
  /// @throws Error as require()
  double at(const TouchEvidence& touch, const Pose& T_object_sensor) const;
  /// Sum over the touches. @throws Error as require()
  double at(std::span<const TouchEvidence> touches, const Pose& T_object_robot) const;
  /// Of every reading but Unknown of every element, [element, level].
  /// @param elements_mm in the sensor frame
  /// @param logs out: room for as many
  void all_readings(std::span<const glm::dvec2> elements_mm, const Pose& T_object_sensor,
                    std::span<double> logs) const;

 private:
  InterpolatedMap map_;
  ContactModel eq7_;  ///< without the table
  std::size_t levels_ = 2;
  // Of a table.
  std::size_t sets_ = 1;
  std::size_t object_ = 0;
  std::vector<double> nats_;  ///< [level, node] of the object
  std::size_t nodes_ = 0;
  double last_node_ = 0.0;
  double first_log_odds_ = 0.0;
  double nodes_per_nat_ = 0.0;
};

}  // namespace palpate
