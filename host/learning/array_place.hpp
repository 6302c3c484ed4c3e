#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "learning/press.hpp"
#include "learning/setup_check.hpp"
#include "learning/setup_judge.hpp"

namespace palpate {

/// Nats that a finding needs. Of sound set-ups none came near it; see tests/learning.
inline constexpr double least_nats = 12.0;

/// Length of the mean of unit vectors at the sensor's angles: 1 where all are alike.
double likeness_of_angles(const SetupJudge& judge, double rad);
/// From this likeness on, angles count as one.
inline constexpr double one_angle = 0.97;

/// Where the array sits in the tool, as "array_offset", by Eq. 7 of touches at known poses of
/// objects whose map is drawn. None without any, or where it sits as its elements are said to be.
std::optional<SetupFinding> offset_on_drawings(const std::vector<Press>& presses,
                                               const std::vector<OccupancyGrid>& maps,
                                               const ContactClassifier& classifier);
/// The presses with their arrays at this pose in the frame of the elements.
std::vector<Press> with_offset(std::vector<Press> presses, const Pose& offset);

// Each adds its finding, if any, to the check, and goes on from the set-up that it mends.

/// Where the array sits in the tool, as "array_offset".
void check_offset(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check,
                  const Pose& start = {});

/// How far apart the elements are.
void check_pitch(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check);

}  // namespace palpate
