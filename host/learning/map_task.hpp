#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "learning/map_request.hpp"
#include "palpate/device.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/touch.hpp"

namespace palpate {

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
