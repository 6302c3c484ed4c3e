#pragma once

#include "learning/setup_judge.hpp"

namespace palpate {

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

}  // namespace palpate
