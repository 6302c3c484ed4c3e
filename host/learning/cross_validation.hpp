#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "learning/drawn_poses.hpp"
#include "learning/familiarity_fit.hpp"
#include "learning/table_learning.hpp"
#include "learning/temperature_fit.hpp"
#include "learning/training_maps.hpp"

namespace palpate {

struct CrossValidationOptions {
  std::size_t folds = 5;             ///< at least 2
  std::size_t maps_per_object = 20;  ///< most maps of an object that a press is placed on
  /// For presses at known poses: they are looked for as_unknown() on these bins; none: all presses
  /// are as they are, on TableLearning::lattice.
  std::optional<RecognitionBins> bins = {};
};

/// What the presses of all folds but one say; see FoldLearning.
struct FoldModel {
  std::vector<TrainingMap> maps;
  TableLearning how;
  std::optional<LearnedTable> table = {};  ///< none: Eq. 7 on the maps' log odds
  /// Only from presses at unknown poses: a touch at a known pose shows a part of an object, and its
  /// features would tell where it is.
  std::optional<LearnedFeatures> features = {};
};

/// What models that had not seen the presses said of them.
struct CrossValidation {
  std::vector<ScoredPress> presses;  ///< those that have a map of their object in the other folds
  /// Several presses at known poses of one object and fold together, with
  /// CrossValidationOptions::bins. A press is in groups of one half only. None where a fold has
  /// fewer presses of each object.
  GroupHalves groups;
  /// [fold], of presses with an element In Contact: known with the maps of their own object and all
  /// others but one, each left out in turn; unknown with those of all others.
  std::vector<FamiliarityScores> familiarity;
  /// Fit::z of presses with an element In Contact, on the best map at about the best pose.
  std::vector<double> fit_z;
};

/// Presses in one of CrossValidation::groups, and most groups that a press is in.
inline constexpr std::size_t presses_in_group = 3;
inline constexpr std::size_t groups_of_press = 3;

/// Recognises every press, at an unknown pose, with what the presses of other folds say, fold by
/// fold, see folds_of(). The log evidence of a label is the log of the mean over its maps; an
/// object without a map in the other folds has none, -infinity. Views into the presses.
class CrossValidator {
 public:
  /// @param labels to recognise, ascending
  /// @throws Error on fewer than two folds or no map per object, and on bins for presses at unknown
  /// poses
  CrossValidator(const std::vector<Press>& presses, std::vector<std::string> labels,
                 const CrossValidationOptions& options);

  /// The presses of all folds but one.
  std::vector<Press> presses_without(std::size_t fold) const;

  /// Adds what a fold's presses get from the model. Takes all host threads.
  /// @param progress called with the fraction done, by one thread at a time
  /// @throws Error as PressPlacer does; what `progress` throws
  void try_fold(std::size_t fold, const FoldModel& model, CrossValidation& result,
                const std::function<void(double)>& progress = {}) const;

 private:
  const std::vector<Press>& presses_;
  std::vector<std::string> labels_;
  CrossValidationOptions options_;
  std::vector<std::size_t> fold_;
};

}  // namespace palpate
