#pragma once

#include "palpate/api.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// What of a map readings are compared with.
enum class MapLayer {
  log_odds,    ///< of occupancy
  mean_level,  ///< the mean pressure
};

/// How a map becomes the grid that a learned likelihood table is over. The values of cells that
/// touches sensed lie in [-8, 8]:
///   log odds, clamped; or
///   mean level p as 16 log(1 + p / unit_level) / log(1 + full_level / unit_level) - 8, clamped.
/// All other cells have values of their own, by the distance d to the nearest sensed cell, centre
/// to centre, and by whether that cell is occupied (log odds above 0):
///   d <= near_mm: -10, or -15 beside an occupied cell; d <= far_mm: -11, or -14; beyond: -12.
/// So a table tells apart what an array would read where nothing was sensed: beside a border that
/// the object may cross, and far from it.
struct PALPATE_API ReadingLayer {
  static constexpr double largest_value = 8.0;
  static constexpr double near_free = -10.0;
  static constexpr double near_occupied = -15.0;
  static constexpr double midway_free = -11.0;
  static constexpr double midway_occupied = -14.0;
  static constexpr double beyond = -12.0;
  /// Nodes of a likelihood table over the values above: half a nat apart.
  static constexpr double first_node = -16.0;
  static constexpr int nodes = 49;

  MapLayer of = MapLayer::log_odds;
  double near_mm = 4.0;
  double far_mm = 12.0;
  double unit_level = 1.0;    ///< pressure, in the recordings' unit
  double full_level = 255.0;  ///< pressure of the value 8

  /// Throws Error unless 0 <= near_mm <= far_mm <= most_length_mm, and both levels are positive.
  void validate() const;
};

/// The grid of Hypothesis::layer: it covers the map and far_mm around it. Its cells stand in
/// `log_odds`, its prior is that of the value beyond. A cell was sensed where `observations` are
/// above 0; without observations, where the log odds differ from the prior's.
/// @throws Error where the map has no mean level but `settings` asks for it, or the map's cells
/// with what is around them exceed most_cells
PALPATE_API OccupancyGrid reading_layer(const OccupancyGrid& map, const ReadingLayer& settings);

}  // namespace palpate
