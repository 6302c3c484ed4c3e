#pragma once

#include "learning/setup_check.hpp"
#include "learning/setup_judge.hpp"

namespace palpate {

/// Nats that a finding needs. Of sound set-ups none came near it; see tests/learning.
inline constexpr double least_nats = 12.0;

/// Length of the mean of unit vectors at the sensor's angles: 1 where all are alike.
double likeness_of_angles(const SetupJudge& judge, double rad);
/// From this likeness on, angles count as one.
inline constexpr double one_angle = 0.97;

// Each adds its finding, if any, to the check, and goes on from the set-up that it mends.

/// Where the array sits in the tool: by a pattern search, refined by a parabola through the
/// neighbours of the best place, whose curvature gives the standard deviations.
void check_offset(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check);

/// How far apart the elements are.
void check_pitch(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check);

}  // namespace palpate
