#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/map_builder.hpp"
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

/// The mask of a shape, whose strokes and polygons cover the centres of the occupied pixels.
/// @throws Error on a shape without area, a point beyond 1 km, and more than `most_pixels`
PALPATE_API Mask mask_of(const Shape& shape, double pixel_mm);

/// How sure a drawing is, as OccupancyGrid's probability of a cell far inside the part; see
/// drawn_map().
inline constexpr double drawn_peak = 0.99;

/// Reach of the default array, the 6 x 6 DigiTacts region, rounded up; see array_reach_mm().
inline constexpr double drawn_reach_mm = 7.0;

/// The sensor model of a drawn map whose options say nothing else.
inline MapOptions drawn_options() { return {.sensor = {.peak = drawn_peak}}; }

/// The map of an object of which there is a drawing. A cell's probability of being occupied is
///   p = (1 - peak) + (2 peak - 1) c,
/// where c is the mask's share of a Gaussian of `spread_mm` about the cell's centre: edges are as
/// soft as the sensor's spread leaves them, and log odds lie within log(peak / (1 - peak)) of 0.
/// The map covers the occupied pixels and all that an array about their outline senses: twice the
/// array's reach, and four spreads. It has the symmetry 1 and suggests the one that it shows, see
/// measure_symmetry().
/// @param options of which the classifier does not count
/// @param reach_mm see array_reach_mm()
/// @throws Error on options or a reach out of range, a peak below 0.5, a mask whose numbers do not
/// agree or that has no occupied pixel, a mask beyond `farthest_mm`, and more than `most_cells`
PALPATE_API OccupancyGrid drawn_map(const std::string& label, const Mask& mask,
                                    const MapOptions& options, double reach_mm);

}  // namespace palpate
