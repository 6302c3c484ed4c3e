#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Maps side by side at one scale, as the bytes of a PNG file: log odds relative to each map's
/// prior in a diverging palette (white = prior, blue = empty, red = occupied), one colour bar in
/// nats and one scale bar in mm for all. y points up. The same maps give the same bytes.
/// @throws Error on an empty list or a map without cells, or if there is no memory for the picture.
std::string draw_maps(std::span<const OccupancyGrid> maps);

/// What one recognised object's sheet shows.
struct RecognitionSheet {
  std::string title;                                   ///< such as the recording's file name
  OccupancyGrid map;                                   ///< of the estimated object
  std::vector<std::vector<glm::dvec2>> footprints_mm;  ///< [touch][element] in the robot frame
  double element_mm = 1.8;                             ///< edge at which an element is drawn
  Pose T_object_robot;                                 ///< estimated
  bool none = false;          ///< "none of these" is more probable than the map's object
  std::string true_object;    ///< label, "" where it is unknown
  std::optional<Pose> truth;  ///< T_object_robot, where it is known and the identity is right
  std::optional<double> error_mm;
  Marginals belief;                           ///< of the estimated object
  std::vector<std::string> labels;            ///< [object]; equal labels are drawn as one, summed
  std::vector<std::vector<double>> identity;  ///< [touch][object] probability after each touch
};

/// The sheet as the bytes of a PNG file: the map with the sensor's footprints at the estimated and
/// at the true pose, the belief over (x, y), and the identity probabilities over the touches. Of
/// the true poses of a symmetric object, the one nearest to the estimate is drawn. The same sheet
/// gives the same bytes.
/// @throws Error on a map without cells, on arrays of the wrong size, where a symmetric object with
/// a truth has no occupied cell, or if there is no memory for the picture.
std::string draw_recognition(const RecognitionSheet& sheet);

}  // namespace palpate
