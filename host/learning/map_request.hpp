#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "options/request.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// What is asked of maps, by the command line or a program; what is left out is empty.
struct MapRequest {
  /// A folder, which ends with / or exists, for a map of each object, or several, and the sensor;
  /// else the file of one map. "": as into a folder that has nothing yet.
  std::string output;
  std::optional<double> cell_mm;    ///< none: 0.5, or half the elements' spacing where unposed
  std::optional<double> spread_mm;  ///< none: the sensor model's, or by the elements' spacing
  std::optional<double> peak;       ///< of the inverse sensor model
  std::string prior;                ///< auto or a number; "": the sensor model's, or auto
  std::string origin;               ///< auto, centroid, robot or X,Y,DEG; "": auto
  std::string symmetry;             ///< N, or LABEL=N,...; "": 1
  bool mirror = false;              ///< the objects may lie on their other sides
  std::string label;                ///< of all maps; "": the recordings' objects
  std::string group;                ///< what is left out together, see grouped_object()
  bool unposed = false;             ///< the recordings' poses do not count
  std::optional<int> max_maps;      ///< of an object whose poses are unknown
  Request shared;  ///< frames, threshold, ratio, sensor_model, touch_sd_mm, touch_sd_deg and device

  bool to_folder() const;
  /// The file of the map of this name.
  std::filesystem::path map_file(const std::string& name) const;
  /// The sensor model of the folder.
  std::filesystem::path sensor_file() const;
  /// By touch_sd_mm and touch_sd_deg.
  DisplacementSd touch_sd() const;

  /// @throws Error on a label that no map can bear, and on values out of range or that contradict
  /// each other
  void validate() const;
};

/// The prior that is given; none where it is to be estimated. @throws Error on another text
std::optional<double> given_prior(const MapRequest& request);

/// The object frame's pose X,Y,DEG in the robot frame of the touches, where the request gives one.
/// @throws Error on an origin that is neither this nor a word, or where poses are unknown
std::optional<Pose> given_origin(const MapRequest& request);
/// Settles the object's frame of a map that was learned in the robot's, or in a given one: centroid
/// puts its origin in the object's middle, and so does auto where a map is drawn, or the robot's
/// origin lies beyond it.
void settle_frame(const MapRequest& request, OccupancyGrid& map);

/// @throws Error where the request's symmetry names a label that no object has
void require_known_symmetries(const MapRequest& request, const std::vector<std::string>& labels);
/// Gives the map the request's symmetry, and what it shows itself, which recognition is not to take
/// where the request says 1.
/// @returns the measured symmetry, see measure_symmetry()
std::optional<RotationalSymmetry> settle_symmetry(const MapRequest& request, OccupancyGrid& map);

/// @throws Error, naming the source, on a label that no map's file can bear
void require_name(const std::string& source, const std::string& label);

/// Maps, and what is to be said of them.
struct LearnedMaps {
  struct Named {
    std::string name;  ///< of its file: the label, or LABEL.2 of several
    OccupancyGrid map;
  };
  std::vector<Named> maps;
  std::optional<LearnedSensor> sensor;    ///< where it was learned, and is better than Eq. 7
  bool replaces_sensor = false;           ///< an older sensor model of the folder is of other maps
  std::vector<std::string> words;         ///< lines about the maps and the sensor
  std::vector<std::string> remarks = {};  ///< sentences that are worth a warning

  /// Adds a map, and lines that say where its frame lies and whether it looks the same after turns,
  /// or as its mirror image.
  /// @param source what it was built from
  void add(const MapRequest& request, OccupancyGrid map, const std::string& source,
           const std::optional<RotationalSymmetry>& symmetry);
};

/// Writes the maps, and the sensor model or removes an older one; makes their folder.
/// @throws Error where a file cannot be written
void save(const MapRequest& request, const LearnedMaps& learned);

}  // namespace palpate
