#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "interpolated_map.hpp"
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

}  // namespace palpate
