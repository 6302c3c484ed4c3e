#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "options/request.hpp"
#include "palpate/device.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

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

/// Where in the recordings a touch stands.
struct TouchSource {
  std::string path;
  std::size_t index = 0;  ///< in the recording
  std::string group;      ///< see grouped_object()
};

/// What learn_maps() takes. Touches are views into the recordings, which the caller keeps alive.
struct MapTask {
  MapRequest request;
  std::span<const Recording> recordings;
  std::optional<LearnedSensor> sensor = {};  ///< that the request names
  bool learns_sensor = false;  ///< with the maps; the folder may have one of earlier maps
  /// By label. Touches are in the robot frame, or in that of the request's origin; where poses are
  /// unknown, all are at the origin.
  std::vector<ObjectTouches> objects = {};
  std::vector<std::vector<TouchSource>> sources = {};  ///< [object][touch]
  std::vector<std::string> remarks = {};               ///< sentences that are worth a warning

  /// The maps' options, by the request or else by a sensor; the prior only where one of both has
  /// it.
  /// @throws Error on pressures without a threshold
  MapOptions options(const std::optional<LearnedSensor>& by) const;
  /// The prior by the request, or else the sensor's; none where it is to be estimated.
  std::optional<double> prior(const std::optional<LearnedSensor>& by) const;
  /// The number of maps that an object may have.
  std::size_t most_maps() const;
  /// The names of the maps that may be learned: labels and, of several maps of one, LABEL.1.
  std::vector<std::string> names() const;
};

/// The name of a map's files, of `count` maps of the label.
std::string name_of(const std::string& label, std::size_t map, std::size_t count);

/// Makes the task: the touches of all recordings by label.
/// @param recordings of touches of one pressure unit, at least one
/// @throws Error naming the option, the recording or the object, where a value is out of range, a
/// label cannot be a map's, several objects are to be one map, all touches of an object are of one
/// group, or touches are not sound or have no outline; and as read_sensor_model()
MapTask map_task(const MapRequest& request, std::span<const Recording> recordings);

/// Learns the maps, and the sensor where the task says so: from the touches of all maps that the
/// folder will have, or none where these do not tell that it is better than Eq. 7. Touches with
/// touch_sd are aligned first. Writes nothing; see save(). Takes all host threads.
/// @param device called once touches at known poses need it
/// @param progress called now and then with the fraction done
/// @throws Error as MapBuilder, align_touches(), unposed_maps() and `device` do; what `progress`
/// throws
LearnedMaps learn_maps(const MapTask& task, const std::function<Device&()>& device,
                       const std::function<void(double)>& progress = {});

/// learn_maps() of touches at unknown poses.
LearnedMaps learn_unposed_maps(const MapTask& task, const std::function<void(double)>& progress);

/// Whether a sensor is learned with the maps: into a folder, unless the request says which sensor.
/// @param remarks receives a sentence where the folder has a sensor model that learn_maps() did not
/// write, or that stays
bool learns_sensor(const MapRequest& request, std::vector<std::string>& remarks);

/// Learns the sensor from all touches that the folder's maps were built from, and says how good it
/// is, or why there is none.
/// @param options of the maps
/// @param learned has the new maps, with their touches and mean levels; receives the sensor
void learn_sensor(const MapTask& task, const MapOptions& options, LearnedMaps& learned,
                  const std::function<void(double)>& progress);
/// Learns the sensor from presses at unknown poses, whose maps are then built with it. It lacks the
/// maps' digests.
void learn_unposed_sensor(const MapTask& task, LearnedMaps& learned,
                          const std::function<void(double)>& progress);

}  // namespace palpate
