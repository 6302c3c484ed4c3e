#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/placed_belief.hpp"
#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Draws maps side by side at one scale and returns the bytes of a PNG file. Colours show log odds
/// relative to each map's prior (white = prior, blue = empty, red = occupied); one colour bar in
/// nats serves all, and each has axes in mm. y points up. The same maps give the same bytes.
/// @param maps at least one; each has cells, and nx * ny log odds, as read_map() and builders make
/// them
/// @throws Error on lack of memory
std::string draw_maps(std::span<const OccupancyGrid> maps);

/// Contents of one recognised object's sheet.
struct RecognitionSheet {
  struct Caption {
    std::string text;
    bool alarm = false;  ///< in red
  };
  std::string title;   ///< such as the recording's file name
  std::string result;  ///< the object and its pose in words; stands first, in large letters
  std::vector<Caption> captions = {};                  ///< below; the first four are drawn
  OccupancyGrid map;                                   ///< of the estimated object
  std::vector<std::vector<glm::dvec2>> footprints_mm;  ///< [touch][element] in the robot frame
  double element_mm = 1.8;                             ///< edge at which an element is drawn
  Pose T_object_robot;                                 ///< estimated
  std::optional<Pose> truth;  ///< T_object_robot, if known and the identity is right
  PlacedBelief belief;        ///< of the estimated object
  /// Where the belief lies, of any object.
  struct Mode {
    std::string name;  ///< such as "E 97.9 %"
    ObjectPose pose;
    bool own = false;  ///< of the estimated pose
  };
  std::vector<Mode> modes = {};
  std::vector<std::string> labels;            ///< [object]; equal labels are drawn as one, summed
  std::vector<std::vector<double>> identity;  ///< [touch][object] probability after each touch
};

/// Draws a sheet and returns the bytes of a PNG file: in the robot frame, the map at the estimated
/// pose, the sensor's footprints and the modes with the ellipses that hold 68 and 95 % of their x
/// and y; the belief over where T_robot_object's origin lies; and the identity probabilities over
/// the touches. For a symmetric object, the true pose drawn is the one nearest to the estimate. The
/// same sheet gives the same bytes.
/// @param sheet its map as for draw_maps(), belief.xy of cells x cells, and after every touch as
/// many probabilities as there are labels
/// @throws Error on a symmetric object with a truth but without an occupied cell, or lack of memory
std::string draw_recognition(const RecognitionSheet& sheet);

}  // namespace palpate
