#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/displacement.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/rotational_symmetry.hpp"
#include "palpate/touch.hpp"
#include "recognition/request.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags of `palpate map`.
struct MapFlags {
  std::vector<std::string> recordings;  ///< or drawings
  std::string output;
  double cell_mm = 0.5;
  bool cell_given = false;
  std::optional<double> spread_mm;
  std::optional<double> touch_sd_mm;
  std::optional<double> touch_sd_deg;
  std::optional<double> peak;
  std::string prior = "auto";
  bool prior_given = false;
  std::optional<double> threshold;
  std::optional<double> ratio;
  std::string sensor_model;
  std::optional<Frames> frames;
  std::string origin;
  std::string symmetry;
  bool mirror = false;
  std::string label;
  std::string group;
  bool unposed = false;
  std::optional<int> max_maps;
  std::optional<double> mm_per_pixel;
  std::string occupied;
  std::optional<double> felt_share;
  std::string array;
  std::string png;
  std::string ros;
  std::string device;

  /// Whether drawings are mapped.
  bool of_drawings() const;
  /// Whether `output` is a folder, for one map of each object or more.
  bool to_folder() const;
};

void add_map_flags(CLI::App& command, MapFlags& flags);
/// Notes which flags were given. Throws Error on a label that no map can bear, on deviations out of
/// range, and where flags do not go with --unposed.
void finish_map_flags(const CLI::App& command, MapFlags& flags);

/// The file of --sensor-model, if given. Throws Error where its pressure unit is not the
/// recordings'.
std::optional<LearnedSensor> sensor_of(const MapFlags& flags,
                                       const std::vector<Recording>& recordings);
/// The map's options but for the prior. A flag overrides the sensor model.
MapOptions map_options(const MapFlags& flags, const std::vector<Recording>& recordings,
                       const std::optional<LearnedSensor>& sensor);
/// By --touch-sd-mm and --touch-sd-deg.
DisplacementSd touch_sd(const MapFlags& flags);
/// The prior by --prior, or else the sensor model's; none where it is to be estimated.
std::optional<double> given_prior(const MapFlags& flags,
                                  const std::optional<LearnedSensor>& sensor);

/// Gives the map the symmetry of --symmetry, and what it shows itself, which recognition is not to
/// take where --symmetry says 1. Returns the measured symmetry, see measure_symmetry().
std::optional<RotationalSymmetry> settle_symmetry(const MapFlags& flags, OccupancyGrid& map);
/// Which point of the robot frame of the touches is the object frame's origin; by --origin.
struct ObjectOrigin {
  /// The robot's own; the object's middle; or the robot's, where that lies on the map.
  enum class Kind { robot, centroid, automatic, given } kind = Kind::automatic;
  Pose T_learned_robot_object{};  ///< where it is given
};
/// Throws Error on a text that is none of these.
ObjectOrigin object_origin(const MapFlags& flags);

/// Where in the files a touch stands.
struct TouchSource {
  std::string path;
  std::size_t index = 0;  ///< in the recording
  std::string group;      ///< by --group; empty without
};

/// The touches of all recordings by label, in the labels' order.
struct GroupedTouches {
  std::vector<ObjectTouches> objects;
  std::vector<std::vector<TouchSource>> sources;  ///< [object][touch]
};
/// Throws Error on a label that no map can bear, on several labels but for a folder, where
/// --symmetry names another, and where --group puts all touches of an object into one. Touches are
/// in the robot frame, or in that of --origin X,Y,DEG; with
/// --unposed all are at the origin.
GroupedTouches group_by_label(const MapFlags& flags, const std::vector<Recording>& recordings,
                              const ContactClassifier& classifier);

/// Throws Error on a label that no map can bear. `path` is named.
void require_name(const std::string& path, const std::string& label);
/// Throws Error where --symmetry names a label that no object has.
void require_known_symmetries(const MapFlags& flags, const std::vector<std::string>& labels);

/// The file of a map of this name: --output, or a file in that folder.
std::filesystem::path map_path(const MapFlags& flags, const std::string& name);
/// The file for ROS beside the map of this name in the folder of --ros.
std::filesystem::path ros_path(const MapFlags& flags, const std::string& name);
/// Throws Error where an output cannot be written or would overwrite an input.
/// @param names of the maps that may be written, as of ros_path()
void prepare_outputs(const MapFlags& flags, const std::vector<std::filesystem::path>& map_paths,
                     const std::vector<std::string>& names);

/// Maps of objects from presses at unknown poses; `palpate map --unposed`.
void build_unposed_maps(const MapFlags& flags);

}  // namespace palpate::cli
