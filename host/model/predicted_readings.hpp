#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "model/interpolated_map.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Number of readings that the model tells apart, Unknown left out: No Contact and the levels of In
/// Contact.
std::size_t reading_levels(const ContactModel& model);

/// What an object at a pose says about every element of an array: the log-likelihood of every
/// reading but Unknown (Eq. 7, or the table), [element, level], in nats.
/// @param contact with a prior
/// @param object index of the object whose numbers of a table are used
std::vector<double> reading_log_likelihoods(std::span<const glm::dvec2> elements_mm,
                                            const Pose& T_object_sensor, const InterpolatedMap& map,
                                            const ContactModel& contact, std::size_t object);

/// What log-likelihoods of the readings of one element predict for it: reading r with probability
/// q(r) = P(r) / sum over all r' of P(r').
struct PredictedReading {
  std::array<double, most_reading_levels> probability{};
  double most = 0.0;        ///< the largest log-likelihood, in nats
  double below_most = 0.0;  ///< mean of the log-likelihood under q, relative to the largest
};
/// @param log_likelihood [level], at most `most_reading_levels`, in nats
PredictedReading predicted_reading(std::span<const double> log_likelihood);

}  // namespace palpate
