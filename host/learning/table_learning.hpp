#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "learning/level_counts.hpp"
#include "learning/press.hpp"
#include "learning/press_placement.hpp"
#include "learning/training_maps.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// How a likelihood table is learned.
struct TableLearning {
  ReadingLayer layer = {};
  std::vector<double> level_edges = {};  ///< see LikelihoodTable
  ContactModel contact = {};             ///< of Eq. 7, with its prior: where learning begins
  PoseLattice lattice = {};              ///< for placing presses at unknown poses
  /// Readings of presses at known poses are counted within half of these steps of where they are,
  /// since recognition compares them at bins so far away.
  BinSteps counted_within = {};
  int rounds = 3;                       ///< of placing and counting
  std::size_t most_maps = 8;            ///< of its object, on which a press is placed
  std::size_t best_maps = 3;            ///< on which a press is counted
  double shared_pseudo_counts = 20.0;   ///< of Eq. 7 in the shared table, at every node
  double object_pseudo_counts = 200.0;  ///< of the shared table in an object's, at every node

  /// Eq. 7 with the table's levels: the first table.
  LearnedTable initial() const;
  /// The contact model that classifies readings into the table's levels.
  ContactModel classifier() const;
};

/// Counts of all objects' readings, by label.
using ObjectCounts = std::map<std::string, LevelCounts>;

/// The table that counts say: the shared one is drawn towards Eq. 7's, and each object's towards
/// the shared one, see shrunk_table(). A level or a node that was never seen so keeps what Eq. 7
/// says, and an object with few counts keeps what all objects say together.
LearnedTable table_of(const ObjectCounts& counts, const TableLearning& how);

/// The contact model of Eq. 7's classifier with an object's numbers of a table, or the shared
/// numbers where the object has none of its own.
ContactModel contact_with(const ContactModel& contact, const LearnedTable& table,
                          const std::string& label);

/// A press on a map of its object.
struct OwnPlacement {
  std::size_t press = 0;
  std::size_t map = 0;
  PressPlacement placement;  ///< of a press at a known pose only that pose is set
};

/// What presses say about readings.
struct PlacedPresses {
  std::vector<OwnPlacement> placements;  ///< of the last round
  LearnedTable table;                    ///< after the last round
};

/// The layers of maps, [map]. Takes all host threads.
std::vector<OccupancyGrid> layers_of(const std::vector<TrainingMap>& maps,
                                     const ReadingLayer& layer);

/// Learns a table by alternation: places every press on maps of its object that it is no part of,
/// counts its readings on the best of them, makes a table of all counts, and places again with it.
/// Presses at known poses are not moved; where all poses are known, one round does. Takes all host
/// threads.
/// @param progress called with the fraction done, by one thread at a time
/// @throws Error where no press has a map of its object that it is no part of, or as PressPlacer
/// does; what `progress` throws
PlacedPresses learn_table(const std::vector<Press>& presses, const std::vector<TrainingMap>& maps,
                          const TableLearning& how,
                          const std::function<void(double)>& progress = {});

/// Counts the readings of placed presses, each on the best of its maps.
/// @param layers of the maps
ObjectCounts count_placed(std::span<const OwnPlacement> placements,
                          const std::vector<Press>& presses,
                          const std::vector<OccupancyGrid>& layers, const TableLearning& how);

}  // namespace palpate
