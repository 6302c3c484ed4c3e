#pragma once

#include <cstddef>
#include <functional>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "estimation/maps/left_out_fit.hpp"
#include "learning/contact_learning.hpp"
#include "learning/held_out.hpp"
#include "learning/press.hpp"
#include "learning/table_learning.hpp"
#include "model/random.hpp"
#include "palpate/contact.hpp"
#include "palpate/lattice.hpp"
#include "palpate/learned_sensor.hpp"

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

/// A table that a calibration may learn: what of a map it is over, and how many levels of readings
/// it tells apart, No Contact included, 2 to most_reading_levels.
struct TableKind {
  MapLayer layer = MapLayer::log_odds;
  std::size_t levels = 2;
};

/// How a sensor is learned from presses, all of them or those of some folds, and how presses are
/// tried on models that have not seen them.
struct CalibrationSettings {
  ReadingOptions readings = {};
  /// Tables to try, the simplest first; none stands for default_tables(). With one object there is
  /// nothing to compare by, and the last is taken.
  std::vector<TableKind> tables = {};
  std::size_t folds = 5;      ///< of the cross-validation, at least 2
  std::size_t most_maps = 5;  ///< of an object, that a press is tried on; above 0
  /// Bins on which unknowns will be recognised, for touches at known poses, which are tried
  /// as_unknown() on them. None stands for bins half the elements' spacing and 5 degrees wide,
  /// about the array's centre; to try_fold(), for TableLearning::lattice.
  std::optional<RecognitionBins> bins = {};

  // calibrate_sensor() sets:
  std::vector<TrainingMap> given = {};  ///< to compare presses with; none: maps of the presses
  std::optional<BinSteps> steps = {};   ///< of the bins; none: poses are unknown
};

/// Presses, and what they say before any table.
struct LearnedPresses {
  std::vector<Press> presses;
  LearnedReadings readings;
  std::vector<TrainingMap> maps;             ///< to learn a table on
  std::vector<TrainingMap> of_objects = {};  ///< of presses at known poses, of all of an object
};

/// The presses with maps to learn a table on: the given ones, or maps of the presses. Takes all
/// host threads.
/// @throws Error as observed_map()
LearnedPresses with_maps(std::vector<Press> presses, LearnedReadings readings,
                         const CalibrationSettings& settings);

/// The lattice, or the finest of its region on which so many minutes of one core are enough to try
/// presses, alone and in groups, on so many maps each; none coarser than presses at unknown poses
/// are placed on.
/// @throws Error where even the coarsest would take too long, or too much memory
PoseLattice affordable_lattice(PoseLattice lattice, const LearnedPresses& learned, std::size_t maps,
                               double minutes);

/// How the presses learn a table.
TableLearning table_learning(const TableKind& kind, const LearnedPresses& learned,
                             const CalibrationSettings& settings);

/// The labels of presses that have a map of their object without them.
std::set<std::string> compared_labels(const LearnedPresses& learned);

/// What the presses of all folds but one say, from the contact threshold on.
struct FoldModel {
  std::vector<TrainingMap> maps;
  TableLearning learning;
  std::optional<LearnedTable> table = {};  ///< none: Eq. 7 on the maps' log odds
  /// Only from presses at unknown poses: a touch at a known pose shows a part of an object, and its
  /// features would tell where it is.
  std::optional<LearnedFeatures> features = {};
};

/// Learns from presses of some folds a model with each table, and after these the model of Eq. 7.
/// Takes all host threads.
/// @returns none where so few presses tell no threshold or make no map
/// @throws what `progress` throws
std::vector<FoldModel> models_of(const std::vector<Press>& presses,
                                 const CalibrationSettings& settings,
                                 const std::function<void(double)>& progress = {});

/// What models that had not seen the presses said of them.
struct CrossValidation {
  /// Presses with a map of their object in the other folds and, with CalibrationSettings::bins,
  /// groups of several of one object and fold. A press is in groups of one half only. A fold with
  /// fewer presses of each object has no groups.
  std::vector<HeldOut> unknowns;
  std::vector<PlaceError> place_errors;  ///< of presses at known poses, by a table

  CrossValidation& operator+=(const CrossValidation& fold);
};

/// Recognises every press of a fold, see folds_of(), at an unknown pose, with what the presses of
/// the other folds say. The log evidence of a label is the log of the mean over its maps, or
/// -infinity where the model has no map of it. Takes all host threads.
/// @param presses of all folds
/// @param labels to recognise, ascending
/// @throws Error as PressPlacer does
CrossValidation try_fold(std::size_t fold, const std::vector<Press>& presses,
                         const std::vector<std::string>& labels, const FoldModel& model,
                         const CalibrationSettings& settings);

}  // namespace palpate
