#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
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

/// The elements in the order of their readings, and the options of an import that say so.
struct ElementOrder {
  std::vector<std::string> options;
  std::vector<glm::dvec2> elements_mm;
};

/// The order as given, without options, and those of a full grid that no turn of an array makes.
std::vector<ElementOrder> orders_but_for_turns(std::span<const glm::dvec2> elements_mm);

/// The finding "element_order" of these options.
SetupFinding order_finding(const std::vector<std::string>& options, double nats);

/// Where an order costs less than this part of all that touches tell, it is not told from others.
inline constexpr double least_share = 0.05;

/// Where an array seems to sit in the tool.
struct FoundMount {
  Pose offset;  ///< of the array in the frame of its elements
  /// Log-probability of all readings, of which those in one square of all touches of an object are
  /// one Beta-distributed share of contact: to be compared between set-ups of one length.
  double nats = 0.0;
};

/// The mount under which the touches agree best, within 60 mm and at any angle, coarse to fine to
/// about a millimetre and 2 degrees. Makes no map; takes all host threads.
/// @param setup its elements are those that the mount moves
FoundMount search_mount(const SetupJudge& judge, const Setup& setup);

// Each adds its finding, if any, to the check, and goes on from the set-up that it mends.

/// The order of the elements that explains the touches better.
void check_order(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check);

/// Where the array sits in the tool, as "array_offset".
void check_offset(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check,
                  const Pose& start = {});

/// How far apart the elements are.
void check_pitch(SetupJudge& judge, Setup& setup, double& nats, SetupCheck& check);

}  // namespace palpate
