#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// The name that the sensor model of a folder's maps has there; `palpate map` writes it.
inline constexpr const char* folder_sensor_name = "sensor.yaml";

/// A number in hexadecimal that hardly any two maps share whose cells differ. The label, the
/// symmetry and what the map was built from do not count.
std::string digest_of(const OccupancyGrid& map);

/// The sensor model in the folder of a map's file; none where there is no such file.
std::optional<std::filesystem::path> sensor_beside(const std::filesystem::path& map);

/// A sensor model and the file that it was read from.
struct SensorFromFile {
  std::string file;
  LearnedSensor sensor;
};

/// The sensor model that lies beside the maps' files, where it was learned for all of these maps.
/// @param remarks receives a sentence where there is one that was not
/// @throws Error where maps come from folders with unlike ones, and as read_sensor_model()
std::optional<SensorFromFile> folder_sensor(std::span<const Hypothesis> hypotheses,
                                            std::vector<std::string>& remarks);

}  // namespace palpate
