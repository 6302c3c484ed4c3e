#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "model/contact_readings.hpp"
#include "model/interpolated_map.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/pose.hpp"

namespace palpate {

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
