#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "learning/press.hpp"
#include "learning/press_placement.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// How often elements read each level where a reading layer has each value: [level, node] over the
/// nodes of ReadingLayer. Counts are fractions: a reading between two nodes counts in both, by
/// nearness, as the table's interpolation weighs them.
class LevelCounts {
 public:
  static constexpr double node_step =
      (ReadingLayer::largest_value - ReadingLayer::first_node) / (ReadingLayer::nodes - 1);
  /// The layer's value at a node.
  static double value_at(int node) { return ReadingLayer::first_node + node_step * node; }

  explicit LevelCounts(std::size_t levels);

  /// Counts one reading; Unknown changes nothing.
  /// @param value of the layer at the reading's place
  /// @param weight by which the reading counts, above 0
  void add(Reading reading, double value, double weight = 1.0);
  /// Counts every element of touches of an object that is at one of some poses, all of them as
  /// likely: a reading counts once in all.
  /// @param touches classified into the table's levels
  /// @param T_object_robot the poses, at least one
  void add(std::span<const TouchEvidence> touches, std::span<const Pose> T_object_robot,
           const OccupancyGrid& layer);
  LevelCounts& operator+=(const LevelCounts& other);

  std::size_t levels() const { return counts_.size() / ReadingLayer::nodes; }
  double at(std::size_t level, int node) const;
  /// Readings of all levels at a node.
  double at_node(int node) const;

 private:
  std::vector<double> counts_;
};

/// The table of Eq. 7 as far as it holds for a layer, in nats, [level, node]. Every node's
/// probabilities sum to 1, and all levels of In Contact are equally likely. A node of log odds has
/// Eq. 7 at its value; a node of mean levels has Eq. 7 at the excess of its value over the
/// threshold's value. Nodes of cells that nothing sensed have Eq. 7 at the prior.
/// @param contact with its prior; its table is not used
std::vector<double> initial_table(const ReadingLayer& layer, std::size_t levels,
                                  const ContactModel& contact);

/// The table that counts say, in nats, as if `pseudo_counts` readings at every node had been
/// distributed as `towards` says: log((n_level + pseudo p_level) / (n + pseudo)), at least
/// log(1e-6). A node without counts keeps the probabilities of `towards`.
/// @param towards table in nats of the same size; its probabilities are normalised
/// @param pseudo_counts above 0
std::vector<double> shrunk_table(const LevelCounts& counts, std::span<const double> towards,
                                 double pseudo_counts);

/// Gamma of Eq. 7 under which readings are most likely where the log odds are known.
/// @param counts of two levels over log odds; nodes of cells that nothing sensed are left out
double fit_gamma(const LevelCounts& counts, double prior);

/// A layer of mean levels whose value 0 is the threshold's, so that half of the nodes tell levels
/// below it apart and half those above: unit_level = threshold^2 / (full - 2 threshold).
/// @param full_level the largest pressure to tell apart; a level below 3 thresholds counts as 3
/// thresholds
/// @throws Error on a threshold that is not positive
ReadingLayer mean_level_layer(double threshold, double full_level);

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
LearnedTable table_of(const ObjectCounts& counts, const TableLearning& settings);

/// A table with an object's numbers, or the shared ones where the object has none of its own.
LikelihoodTable table_for(const LearnedTable& table, const std::string& label);
/// The contact model of Eq. 7's classifier with table_for() the object.
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
                          const TableLearning& settings,
                          const std::function<void(double)>& progress = {});

/// Counts the readings of placed presses, each on the best of its maps.
/// @param layers of the maps
ObjectCounts count_placed(std::span<const OwnPlacement> placements,
                          const std::vector<Press>& presses,
                          const std::vector<OccupancyGrid>& layers, const TableLearning& settings);

}  // namespace palpate
