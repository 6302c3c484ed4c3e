#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "learning/familiarity_fit.hpp"
#include "learning/fold_model.hpp"
#include "learning/temperature_fit.hpp"
#include "learning/tried_bins.hpp"

namespace palpate {

struct CrossValidationOptions {
  std::size_t folds = 5;             ///< at least 2
  std::size_t maps_per_object = 20;  ///< most maps of an object that a press is placed on, above 0
  /// For presses at known poses, which are looked for as_unknown() on these bins; none: all presses
  /// stay as they are, and are looked for on TableLearning::lattice.
  std::optional<RecognitionBins> bins = {};
};

/// What models that had not seen the presses said of them.
struct CrossValidation {
  std::vector<ScoredPress> presses;  ///< with a map of their object in the other folds
  /// Several presses at known poses of one object and fold together, with
  /// CrossValidationOptions::bins. A press is in groups of one half only. None where a fold has
  /// fewer presses of each object.
  GroupHalves groups;
  /// [fold] Scores of presses with an element In Contact: known with the maps of their own object
  /// and all others but one, each left out in turn; unknown with the maps of all others.
  std::vector<FamiliarityScores> familiarity;
  /// Fit::z of presses with an element In Contact, on the best map at about the best pose.
  std::vector<double> fit_z;
};
/// The cross-validation of several folds, each of which has one FamiliarityScores.
CrossValidation joined(std::span<const CrossValidation> folds);

/// Presses in one of CrossValidation::groups, and most groups that a press is in.
inline constexpr std::size_t presses_in_group = 3;
inline constexpr std::size_t groups_of_press = 3;

/// Recognises every press of a fold, see folds_of(), at an unknown pose, with what the presses of
/// the other folds say. The log evidence of a label is the log of the mean over its maps, or
/// -infinity where the model has no map of it. Takes all host threads.
/// @param presses of all folds
/// @param labels to recognise, ascending
/// @param progress called with the fraction done, by one thread at a time
/// @throws Error as PressPlacer does; what `progress` throws
CrossValidation try_fold(std::size_t fold, const std::vector<Press>& presses,
                         const std::vector<std::string>& labels, const FoldModel& model,
                         const CrossValidationOptions& options,
                         const std::function<void(double)>& progress = {});

}  // namespace palpate
