#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Predicts the readings of an array on the hypotheses' objects, in float32 and from tables: for
/// thousands of imagined touches.
class ReadingPredictor {
 public:
  /// Copies the maps.
  /// @param contact resolved for these hypotheses: with a prior
  ReadingPredictor(std::span<const Hypothesis> hypotheses, const ContactModel& contact);

  /// Readings that are told apart, Unknown left out.
  std::size_t levels() const { return levels_; }

  /// Writes the log-probability of every reading of every element, log L(level) / sum of all
  /// levels' L, into logs[(element * levels() + level) * stride]. Differs from
  /// reading_log_likelihoods(), normalised, by at most 2e-4 nats, except where log odds lie beyond
  /// +-16: these count as +-16.
  void predict(std::size_t object, const Pose& T_object_sensor,
               std::span<const glm::dvec2> elements_mm, std::span<float> logs,
               std::size_t stride) const;

 private:
  struct Map {
    glm::dvec2 first_mm;  ///< of the border's first node
    double cells_per_mm = 1.0;
    int width = 0;
    int height = 0;
    std::vector<float> log_odds;  ///< [height, width], with a border of the prior
  };

  std::size_t levels_;
  std::size_t sets_;  ///< 1, or one for each object
  std::vector<Map> maps_;
  std::vector<float> table_;  ///< [set, node, level] log-probabilities
};

}  // namespace palpate
