#pragma once

#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "learning/press.hpp"
#include "model/random.hpp"
#include "palpate/contact.hpp"
#include "palpate/lattice.hpp"

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

/// Presses in a group, and most groups that a press is in.
inline constexpr std::size_t presses_in_group = 3;
inline constexpr std::size_t groups_of_press = 3;

/// Touches of one object at known poses as one press, in the robot frame of the first.
/// @param presses at known poses, at least one
Press together(std::span<const Press* const> presses);

/// A press, or a group of presses, of a fold that is to be recognised.
struct Trial {
  Press press;
  std::optional<std::size_t> half = {};  ///< see HeldOut::half
};
/// A trial of each press. With bins (poses are known) trials of groups of presses_in_group presses
/// of one object follow, and all are as_unknown().
std::vector<Trial> trials_of(const std::vector<Press>& presses,
                             const std::optional<RecognitionBins>& bins, std::size_t fold);

/// Steps of theta at which presses at unknown poses are placed; steps of x and y are the elements'
/// spacing.
inline constexpr double placing_step_rad = std::numbers::pi / 18.0;

/// Bins half an element's spacing and 5 degrees wide over the places of the arrays' centres, with
/// room for a bin around them.
/// @param presses at known poses, at least one
PoseLattice fine_lattice(const std::vector<Press>& presses, double spacing_mm);

/// @param presses at known poses
/// @throws Error on an array whose centre is more than a bin beyond the lattice's x or y
void require_within(const std::vector<Press>& presses, const PoseLattice& lattice);

/// What it may cost to try presses on bins, alone and in groups.
struct TrialCost {
  std::size_t maps = 0;     ///< on which each press is tried
  double spacing_mm = 0.0;  ///< of the elements
  double minutes = 0.0;     ///< of one core
};

/// The lattice, or the finest of its region that the cost allows, but none coarser than presses at
/// unknown poses are placed on.
/// @throws Error where even the coarsest would take too long, or too much memory
PoseLattice affordable_lattice(PoseLattice lattice, const std::vector<Press>& presses,
                               const ContactClassifier& classifier, const TrialCost& cost);

}  // namespace palpate
