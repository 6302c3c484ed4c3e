#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "model/interpolated_map.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"

namespace palpate {

/// The log-likelihood of touches on one map, for many poses: what depends on neither touch nor pose
/// is worked out once.
class EvidenceLikelihood {
 public:
  /// @param map what readings are compared with
  /// @param contact sound, with a table, see tabulated()
  /// @param object whose numbers of the table are read
  EvidenceLikelihood(const InterpolatedMap& map, const ContactModel& contact, std::size_t object);

  /// Log-likelihood of a reading where the map has these log odds, in nats. Not for Unknown.
  double of(Reading reading, double log_odds) const {
    const double place = std::clamp((log_odds - first_log_odds_) * nodes_per_nat_, 0.0, last_node_);
    const auto node = std::min(static_cast<std::size_t>(place), nodes_ - 2);
    const double* nats = nats_.data() + static_cast<std::size_t>(reading) * nodes_ + node;
    return nats[0] + (place - static_cast<double>(node)) * (nats[1] - nats[0]);
  }
  /// Sum over the touch's known elements, in nats.
  /// @param T_object_sensor in the place of the touch's own pose
  double at(const TouchEvidence& touch, const Pose& T_object_sensor) const;

 private:
  InterpolatedMap map_;
  std::vector<double> nats_;  ///< [level, node]
  std::size_t nodes_;
  double last_node_;
  double first_log_odds_;
  double nodes_per_nat_;
};

}  // namespace palpate
