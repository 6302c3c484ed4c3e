#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "model/cell_range.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The log odds of an object's touches (Eq. 4-6), each reading's within 1e-3 nats. A touch can be
/// taken out, so that the map of the others predicts it, and be put back, there or elsewhere.
class PredictiveMap {
 public:
  /// The map of all touches. It covers what they sense; what a touch that is put elsewhere senses
  /// beyond is lost.
  /// @param options with the prior
  /// @throws Error on a touch that is not sound, and as cover() does
  PredictiveMap(std::span<const Touch> touches, const MapOptions& options);

  std::size_t size() const { return touches_.size(); }
  void take_out(std::size_t touch);
  void put_in(std::size_t touch, const Pose& T_robot_sensor);
  /// Log-likelihood (Eq. 7) of the touch's readings at this pose, in nats.
  double log_likelihood(std::size_t touch, const Pose& T_robot_sensor) const;

 private:
  struct Part {
    std::vector<ElementReading> known;                  ///< in the sensor frame
    std::vector<std::pair<std::size_t, double>> added;  ///< to these cells, in nats
  };

  double increment(Reading reading, double squared_mm) const;
  double log_odds(const glm::dvec2& p_robot_mm) const;

  MapOptions options_;
  ContactModel contact_;
  std::vector<Part> touches_;
  double radius_mm_ = 0.0;
  /// [contact or none] nats at equally spaced squares of the distance, up to the radius's.
  std::array<std::vector<double>, 2> increments_;
  CellRange cells_;
  std::vector<double> log_odds_;  ///< of cells_, [ny, nx]
};

}  // namespace palpate
