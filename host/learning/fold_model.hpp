#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "learning/cross_validation.hpp"
#include "learning/press.hpp"
#include "learning/reading_learning.hpp"
#include "learning/table_learning.hpp"
#include "learning/training_maps.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// A table that a calibration may learn: what of a map it is over, and how many levels of readings
/// it tells apart, No Contact included, 2 to most_reading_levels.
struct TableKind {
  MapLayer layer = MapLayer::log_odds;
  std::size_t levels = 2;
};

/// What presses are learned from with, whichever they are.
struct ModelLearning {
  ReadingOptions readings;
  std::size_t folds = 5;                ///< that maps of touches at known poses are built without
  std::vector<TrainingMap> given = {};  ///< to compare presses with; none: maps of the presses
  std::optional<BinSteps> bins = {};    ///< for presses at known poses; none: poses are unknown
};

/// Presses, and what they say before any table.
struct LearnedPresses {
  std::vector<Press> presses;
  LearnedReadings readings = {};
  std::vector<TrainingMap> maps = {};  ///< to learn a table on
};

/// The maps to learn a table on: those given, or those of the presses. Takes all host threads.
/// @throws Error as observed_map()
std::vector<TrainingMap> maps_to_learn_on(const LearnedPresses& learned, const ModelLearning& how);

/// How the presses learn a table.
TableLearning table_learning(const TableKind& kind, const LearnedPresses& learned,
                             const ModelLearning& how);

/// Whether a press has a map of a label that it is no part of.
bool has_map_without(std::size_t press, const std::string& label,
                     const std::vector<TrainingMap>& maps);

/// What is learned from the presses of all folds but one, from the contact threshold on: for each
/// table in turn, and then by Eq. 7.
class FoldLearning {
 public:
  /// Takes all host threads.
  /// @param others the presses of the other folds
  /// @throws Error as learn_readings() and observed_map()
  FoldLearning(std::vector<Press> others, const ModelLearning& how);

  const FoldModel& learn(const TableKind& kind, const std::function<void(double)>& progress = {});
  const FoldModel& by_eq7();

 private:
  const ModelLearning& how_;
  LearnedPresses learned_;
  FoldModel model_;
};

}  // namespace palpate
