#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "palpate/contact_model.hpp"

namespace palpate {

/// By how much a place on a map makes a reading more likely than a place beyond the map, as a table
/// over the values of the grid that readings are compared with.
class ReadingGains {
 public:
  /// @param beyond the grid's value beyond its cells
  /// @param object whose numbers of the model's table count
  ReadingGains(const ContactModel& contact, double beyond, std::size_t object);

  std::size_t levels() const { return gains_.size() / nodes; }
  /// In nats, by the nearest of values 1/32 apart.
  float at(std::size_t level, double value) const { return gains_[level * nodes + node_of(value)]; }
  /// Where a value stands in the table of each level; for at_node().
  static std::size_t node_of(double value) {
    const double place = (std::clamp(value, -largest, largest) + largest) * per_nat + 0.5;
    return static_cast<std::size_t>(place);
  }
  float at_node(std::size_t level, std::size_t node) const { return gains_[level * nodes + node]; }

 private:
  /// Covers all values of a ReadingLayer; Eq. 7 changes by less than 1e-5 nats beyond it.
  static constexpr double largest = 16.0;
  static constexpr double per_nat = 32.0;
  static constexpr std::size_t nodes = static_cast<std::size_t>(2.0 * largest * per_nat) + 1;

  std::vector<float> gains_;  ///< [level, node]
};

}  // namespace palpate
