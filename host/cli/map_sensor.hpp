#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/map_flags.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate::cli {

/// The sensor model of the folder of --output.
std::filesystem::path sensor_file(const MapFlags& flags);
/// Whether maps are written for a sensor that is learned with them: into a folder, without
/// --sensor-model. Says so where the folder has a sensor model that `palpate map` did not write.
bool learns_sensor(const MapFlags& flags);

/// A sensor model for the maps of a folder, and some lines about it.
struct MapSensor {
  std::optional<LearnedSensor> sensor;  ///< none where it is not better, or cannot be learned
  std::string words;
};
/// Learns the sensor from all touches that the folder's maps were built from.
/// @param maps that are written anew, with their touches and mean levels
/// @param written their files
/// @param model of these maps
MapSensor learn_sensor(const MapFlags& flags, const std::vector<OccupancyGrid>& maps,
                       const std::vector<std::filesystem::path>& written, const MapOptions& model);
/// Learns the sensor from presses at unknown poses, whose maps are then built with it.
/// @param written the files that their maps may have
MapSensor learn_unposed_sensor(const MapFlags& flags, const std::vector<Recording>& recordings,
                               const std::vector<std::filesystem::path>& written);

/// Writes the folder's sensor model, or removes one that is of older maps, and says which.
void write_sensor(const MapFlags& flags, const MapSensor& learned);

}  // namespace palpate::cli
