#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "drawn_poses.hpp"
#include "familiarity_fit.hpp"
#include "table_learning.hpp"
#include "temperature_fit.hpp"
#include "training_maps.hpp"

namespace palpate {

struct CrossValidationOptions {
  std::size_t folds = 5;             ///< at least 2
  std::size_t maps_per_object = 20;  ///< most maps of an object that a press is placed on
  /// For presses at known poses: they are looked for as_unknown() on these bins; none: all presses
  /// are as they are, on TableLearning::lattice.
  std::optional<RecognitionBins> bins = {};
};

/// What models that had not seen the presses said of them.
struct CrossValidation {
  std::vector<std::string> labels;   ///< of all maps, ascending
  std::vector<ScoredPress> presses;  ///< those that have a map of their object in the other folds
  /// Several presses at known poses of one object and fold together, with
  /// CrossValidationOptions::bins. A press is in groups of one half only. None where a fold has
  /// fewer presses of each object.
  GroupHalves groups;
  /// See FamiliarityScores: with the maps of all objects, and without those of the press's own.
  std::vector<FamiliarityScore> known;
  std::vector<FamiliarityScore> unknown;
  /// Fit::z of presses with an element In Contact, on the best map at about the best pose.
  std::vector<double> fit_z;
};

/// Presses in one of CrossValidation::groups, and most groups that a press is in.
inline constexpr std::size_t presses_in_group = 3;
inline constexpr std::size_t groups_of_press = 3;

/// Recognises every press, at an unknown pose, with maps and numbers of the presses of other folds
/// alone, see folds_of(). The log evidence of a label is the log of the mean over its maps; an
/// object without a map in the other folds has none, -infinity.
/// @param placed what learn_table() found for all presses: counts leave a fold's presses and maps
/// out. None: Eq. 7 on the maps' log odds
/// @param progress called with the fraction done, by one thread at a time
/// @throws Error where no press has a map of its object in the other folds, on fewer than two folds
/// or no map per object, on bins for presses at unknown poses, and as PressPlacer does; what
/// `progress` throws
CrossValidation cross_validate(const std::vector<Press>& presses,
                               const std::vector<TrainingMap>& maps, const TableLearning& how,
                               const PlacedPresses* placed, const CrossValidationOptions& options,
                               const std::function<void(double)>& progress = {});

}  // namespace palpate
