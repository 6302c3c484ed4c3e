#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "model/bounding_box.hpp"
#include "model/cell_range.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The map of touches at known poses, as MapBuilder builds it, with what learning needs besides:
///   observations: number of touches of which a known element lies within one element spacing of
///     the cell's centre. The spacing is the largest distance of an element of the touch's array to
///     its nearest neighbour; twice the sensor model's spread for an array of one element.
///   mean_level: mean over these touches of the pressure at the cell. A touch's pressure at a cell
///     is the mean over its living elements, weighted by a Gaussian of their distance whose
///     standard deviation is the sensor model's spread, at least a quarter of the spacing; it
///     leaves out elements beyond four deviations and the spacing. A pressure below 0 counts as 0.
/// The object frame is the robot frame of the touches. Computes on the calling thread in float64.
/// @throws Error as MapBuilder does
OccupancyGrid observed_map(std::span<const Touch> touches, const MapOptions& options,
                           const std::string& label);

/// Maps of touches that are divided into parts.
struct ObservedMaps {
  OccupancyGrid all;
  /// [part] the map of the touches of all other parts; without cells where there are none
  std::vector<OccupancyGrid> without;
};
/// observed_map() of all touches and without each part, in hardly more time than of all. Gaussians
/// are cut off where they are for all touches. Takes all host threads.
/// @param part of every touch, counted from 0
/// @throws Error as observed_map() for any of the maps
ObservedMaps observed_maps(std::span<const Touch> touches, std::span<const std::size_t> part,
                           const MapOptions& options, const std::string& label);

/// Where what one press says, observed_map() of the press by itself, lies on a map of several.
struct ImagePlace {
  Pose T_object_image;
  bool mirrored = false;  ///< the image is mirrored, x to -x, before the pose
  double weight = 1.0;    ///< above 0: how sure the place is
};

/// What touches say of the cells of a map, summed in float64.
class MapSums {
 public:
  /// @param range of the cells; it grows by images
  explicit MapSums(const MapOptions& options, const CellRange& range = {});

  /// Adds a touch: its evidence (Eq. 4-6), and its pressure where it observed cells.
  /// @param known elements of the touch, in the robot frame
  /// @param radius_mm at which Gaussians are cut off
  void add(const Touch& touch, std::span<const ElementReading> known, double radius_mm);
  /// Adds what a press says, weighted, at the cells that it observed. Its image is read bilinearly
  /// between the observed cells, without error where its cells fall on the map's.
  void add(const OccupancyGrid& image, const ImagePlace& place) { change(image, place, 1); }
  /// Takes back an image that was added at this very place.
  void remove(const OccupancyGrid& image, const ImagePlace& place) { change(image, place, -1); }
  /// Adds sums over the same cells.
  MapSums& operator+=(const MapSums& other);

  /// The map of touches that were added: the sum of the evidence, the number of touches that
  /// observed a cell, and their mean pressure.
  /// @throws Error where no touch has a known element, or the map is not sound
  OccupancyGrid sum(const std::string& label, double radius_mm) const;
  /// The map of the observed cells, or of one cell where there are none: the weighted means of
  /// evidence and pressure, and the number of presses that observed a cell.
  OccupancyGrid mean(const std::string& label) const;

 private:
  struct Cell {
    double evidence = 0.0;  ///< log odds beyond the prior's, weighted
    double level = 0.0;     ///< pressure, weighted
    double weight = 0.0;    ///< of the touches that observed the cell
    int touches = 0;        ///< that observed the cell
  };

  void change(const OccupancyGrid& image, const ImagePlace& place, int sign);
  void make_room(const CellRange& needed);
  OccupancyGrid map(const std::string& label, const CellRange& range, bool mean) const;

  MapOptions options_;
  CellRange range_;
  BoundingBox touched_;      ///< around the known elements of touches
  std::vector<Cell> cells_;  ///< of the range, [ny, nx]
};

}  // namespace palpate
