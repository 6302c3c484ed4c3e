#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/simulation.hpp"

namespace palpate {

/// Which places of a plane a drawing shows as occupied: square pixels, row 0 at the lowest y.
struct Mask {
  double pixel_mm = 1.0;           ///< edge of a pixel
  glm::dvec2 origin_mm{0.0, 0.0};  ///< centre of pixel (row 0, column 0), in the object frame
  std::size_t rows = 0;            ///< along y
  std::size_t columns = 0;         ///< along x
  std::vector<std::uint8_t> occupied = {};  ///< [rows, columns], row-major; 0: empty
};

/// Most pixels of a picture or a mask that Palpate makes itself.
inline constexpr double most_pixels = 1e8;

/// Pixels of a mask along a cell of the map: they move no edge by more than a tenth of a cell.
inline constexpr double pixels_of_cell = 5.0;

/// The mask of a shape, whose strokes and polygons cover the centres of the occupied pixels.
/// @throws Error on a shape without area, a point beyond 1 km, and more than `most_pixels`
PALPATE_API Mask mask_of(const Shape& shape, double pixel_mm);

/// How a map is made of a drawing.
struct PALPATE_API DrawnMapOptions {
  double cell_mm = 0.5;    ///< edge of a cell
  double spread_mm = 0.5;  ///< half the standard deviation of the sensor's point spread
  /// How sure a drawing is: log odds lie within log(peak / (1 - peak)) of 0, by default 6.9 nats.
  /// Touched maps reach more, but more changes Eq. 7 by less than 0.05 nats at a prior of 0.2.
  double peak = 0.999;
  double prior = 0.2;  ///< of what lies beyond the map
  /// Share of an element's point spread on the object from which on it feels the object: by default
  /// midway between No Contact, below 2 of 20 kPa, and In Contact, above 0.3 of the largest
  /// pressure. 0.5 leaves outlines where they are drawn.
  double felt_share = 0.2;
  double reach_mm = 7.0;  ///< of the array, see array_reach_mm(); by default the 6 x 6 DigiTacts'

  /// Throws Error on a peak not above 0.5, a share that is not between 0 and 1, a negative reach,
  /// and as MapOptions::validate()
  void validate() const;
};

/// The map of an object of which there is a drawing. Where c is the share of the point spread, a
/// Gaussian of twice `spread_mm`, about a cell's centre that lies on the object, and f
/// `felt_share`, the cell is occupied with the probability
///   p = (1 - peak) + (2 peak - 1) o^2 / (1 + o^2), o = c (1 - f) / ((1 - c) f):
/// as touched maps have it, the object is as large as elements feel it, with edges about a spread
/// wide. The map covers all that an array senses which feels the object with one element: twice the
/// array's reach and four spreads about the occupied pixels. It has the symmetry 1 and suggests the
/// one that it shows, see measure_symmetry().
/// @throws Error on options out of range, a mask whose numbers do not agree or that has no occupied
/// pixel or lies beyond `farthest_mm`, an object too thin to be felt, and more than `most_cells`
PALPATE_API OccupancyGrid drawn_map(const std::string& label, const Mask& mask,
                                    const DrawnMapOptions& options = {});

}  // namespace palpate
