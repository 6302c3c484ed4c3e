#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "learning/contact_learning.hpp"
#include "learning/press.hpp"
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

/// How presses are learned from, all of them or those of some folds.
struct ModelLearning {
  ReadingOptions readings;
  std::size_t folds = 5;                ///< that maps of touches at known poses are built without
  std::vector<TrainingMap> given = {};  ///< to compare presses with; none: maps of the presses
  std::optional<BinSteps> bins = {};    ///< for presses at known poses; none: poses are unknown
};

/// Presses, and what they say before any table.
struct LearnedPresses {
  std::vector<Press> presses;
  LearnedReadings readings;
  std::vector<TrainingMap> maps;  ///< to learn a table on
};

/// The presses with maps to learn a table on: the given ones, or maps of the presses. Takes all
/// host threads.
/// @throws Error as observed_map()
LearnedPresses with_maps(std::vector<Press> presses, LearnedReadings readings,
                         const ModelLearning& how);

/// How the presses learn a table.
TableLearning table_learning(const TableKind& kind, const LearnedPresses& learned,
                             const ModelLearning& how);

/// The labels of presses that have a map of their object without them.
std::set<std::string> compared_labels(const LearnedPresses& learned);

/// What the presses of all folds but one say, from the contact threshold on.
struct FoldModel {
  std::vector<TrainingMap> maps;
  TableLearning how;
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
                                 const std::vector<TableKind>& tables, const ModelLearning& how,
                                 const std::function<void(double)>& progress = {});

}  // namespace palpate
