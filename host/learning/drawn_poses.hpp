#pragma once

#include <span>

#include "learning/press.hpp"
#include "model/random.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// The bins on which unknown objects are recognised.
struct RecognitionBins {
  PoseLattice lattice;
  /// The pivot is the array's centre at the first touch of each unknown; else it is the lattice's.
  bool auto_pivot = true;
};

/// A press as if the robot did not know the object's pose. Its robot frame is put so that the pose
/// is anywhere in the bins' region, and as far from the nearest bin as an unknown's may be. With an
/// automatic pivot, x and y stay within half a bin of where they are.
/// @param bins with the pivot (0, 0) where it is automatic
/// @param press at a known pose; T_object_robot of the returned one is the drawn pose
Press as_unknown(const Press& press, const RecognitionBins& bins, Random& random);

/// Touches of one object at known poses as one press, in the robot frame of the first.
/// @param presses at known poses, at least one
Press together(std::span<const Press* const> presses);

}  // namespace palpate
