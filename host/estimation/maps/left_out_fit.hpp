#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "model/touch_evidence.hpp"
#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/fit.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

/// Mean and standard deviation of numbers z of one object; none where they do not differ.
std::optional<FitScale> scale_of(std::span<const double> z);

/// Where some touches together seem to lie, relative to where they were, and what their belief says
/// of it: how far the body is moved, see motion_covariance().
struct PlaceError {
  glm::dvec3 moved_mm{0.0};
  glm::dmat3 covariance{0.0};
};
/// The errors of groups of 3, 9 and 27 touches, of each size as many as 54 touches make. Left out
/// are groups that lie more than 1.5 mm away, at another peak, and those of a belief 0.8 mm wide.
/// @param touches T_robot_sensor is of the sensor in the object frame
/// @param contact with a prior, by which the touches are classified
std::vector<PlaceError> place_errors(std::span<const TouchEvidence> touches, const Hypothesis& of,
                                     const ContactModel& contact);
/// The scale by which the errors are likeliest, as normal ones: what of them falls as touches add
/// up is the factor's, what remains the map's. None of fewer than 16 errors.
std::optional<PoseScale> pose_scale_of(std::span<const PlaceError> errors);

/// [touch] the number of its place, a square of 1.7 mm that holds the array's centre, however the
/// array is turned. Each touch has a place of its own where these are fewer than `least`.
std::vector<std::size_t> places_of(std::span<const TouchEvidence> touches, std::size_t least);

/// Sets MapSource::left_out and pose_scale. Builds maps of random three quarters of the touches,
/// and judges the others at their poses, until about 200 are judged, or each touch once. For
/// pose_scale, touches at one place are left out together: turned by half a turn, an array has
/// elements where it had others, so that a map of these places it better than one of touches
/// elsewhere. With two MapSource::groups or more, both are of touches on maps without their group.
/// Both are none where fewer than 16 touches are in contact.
/// @throws Error as MapBuilder does
void judge_left_out(Device& device, MapSource& source);

}  // namespace palpate
