#pragma once

#include <string>
#include <vector>

#include "model/cell_range.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// What one press says around its elements: observed_map() of the press by itself, in the sensor
/// frame or in the object's.
using PressImage = OccupancyGrid;

/// Where a press lies on a fused map.
struct ImagePlace {
  Pose T_object_image;
  bool mirrored = false;  ///< the image is mirrored, x to -x, before the pose
  double weight = 1.0;    ///< above 0: how sure the place is
};

/// Weighted means over presses of what their images say, in the object frame. Only cells that an
/// image's press observed count. Images are read bilinearly between the observed cells, without
/// error where their cells fall on the map's.
class FusedMap {
 public:
  explicit FusedMap(const MapOptions& options) : options_(options) {}

  void add(const PressImage& image, const ImagePlace& place) { change(image, place, 1); }
  /// Takes back an image that was added at this very place.
  void remove(const PressImage& image, const ImagePlace& place) { change(image, place, -1); }

  /// The map: log odds, the prior's where no press observed the cell; number of presses that
  /// observed it; mean pressure. Covers the observed cells; one cell where there are none.
  OccupancyGrid map(const std::string& label) const;

 private:
  struct Cell {
    double weight = 0.0;
    double evidence = 0.0;  ///< log odds beyond the prior's, weighted
    double level = 0.0;     ///< pressure, weighted
    int presses = 0;
  };

  void change(const PressImage& image, const ImagePlace& place, int sign);
  /// Makes room for cells.
  void make_room(const CellRange& needed);

  MapOptions options_;
  CellRange range_;
  std::vector<Cell> cells_;  ///< of the range, [ny, nx]
};

}  // namespace palpate
