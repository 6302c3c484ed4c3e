#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/reading_layer.hpp"

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
  /// All readings.
  double total() const;

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

/// A layer of mean levels whose value 0 is the threshold's, so that half of the nodes tell levels
/// below it apart and half those above: unit_level = threshold^2 / (full - 2 threshold).
/// @param full_level the largest pressure to tell apart; a level below 3 thresholds counts as 3
/// thresholds
/// @throws Error on a threshold that is not positive
ReadingLayer mean_level_layer(double threshold, double full_level);

}  // namespace palpate
