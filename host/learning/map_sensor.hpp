#pragma once

#include <functional>
#include <string>
#include <vector>

#include "learning/map_task.hpp"

namespace palpate {

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
