#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "options/request.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The request with all that it leaves out and its scene file gives. @throws Error
Request complete(Request request);

/// The objects to recognise, by their files, or by the names of the maps in memory.
/// @throws Error where there are none, or a folder has no maps
std::vector<Scene::Object> objects_of(const Request& request);

/// The files that the task depends on, after the options that name them: the scene, its array, the
/// sensor model, the maps with the sensor models beside them. @throws Error as objects_of() does
std::vector<std::pair<std::string, std::filesystem::path>> files_of(const Request& request);

/// The maps in a folder: its *.map.h5 and what else is a map among its *.h5, in order.
/// @throws Error where the folder cannot be read
std::vector<std::filesystem::path> maps_in(const std::filesystem::path& folder);
/// The map files that an argument of --maps stands for: itself or, of a folder, maps_in().
/// @throws Error where a folder has none
std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument);

/// The name that the sensor model of a folder's maps has there; `palpate map` writes it.
inline constexpr const char* folder_sensor_name = "sensor.yaml";

/// A number in hexadecimal that hardly any two maps share whose cells differ. The label, the
/// symmetry and what the map was built from do not count.
std::string digest_of(const OccupancyGrid& map);

/// A sensor model, and the file that it was read from: "" of one that no file has.
struct SensorFromFile : LearnedSensor {
  std::string file = {};
};
/// @throws Error as read_sensor_model()
SensorFromFile sensor_from(const std::filesystem::path& file);

/// The sensor model that lies beside the maps' files, where it was learned for all of these maps;
/// else one of no file.
/// @param remarks receives a sentence where there is one that was not
/// @throws Error where maps come from folders with unlike ones, and as read_sensor_model()
SensorFromFile folder_sensor(std::span<const Hypothesis> hypotheses,
                             std::vector<std::string>& remarks);

/// Whether neither bins nor any part of a region are given: the region then follows from the maps
/// and the touches' arrays.
bool infers_region(const Request& request);

/// The bins of a request that does not infer the region; what it leaves open is PoseLattice's. The
/// pivot is (0, 0) where it is automatic. @throws Error
PoseLattice given_lattice(const Request& request);
bool has_auto_pivot(const Request& request);

/// Replaces the source's array by the scene's, where the scene has an array. @throws Error where
/// the two differ in their number of elements
void replace_array(const Request& request, const std::string& source, std::size_t elements,
                   std::vector<glm::dvec2>& elements_mm);
/// The same of a recording.
void replace_array(const Request& request, Recording& recording);

}  // namespace palpate
