#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/map_flags.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/rotational_symmetry.hpp"

namespace palpate::cli {

/// Settles the object's frame of a map that was learned in the robot's, or in a given one.
void settle_frame(const ObjectOrigin& origin, OccupancyGrid& map);

/// Makes the folders that --output and --ros name. Nothing is written before all maps are built, so
/// that a failure leaves nothing behind.
void make_map_folders(const MapFlags& flags);
/// Writes the map for ROS where --ros is given, and says so.
void write_for_ros(const MapFlags& flags, const std::string& name, const OccupancyGrid& map);
/// Writes the picture of --png, where that is given, and says so.
void write_picture(const MapFlags& flags, const std::string& png);

/// Where a map is written, and what is said of it.
struct WrittenMap {
  std::filesystem::path path;
  std::string source;  ///< what it was built from
  std::optional<RotationalSymmetry> symmetry = {};
};
/// Writes maps, with --ros and --png as these say, and says so.
/// @param written [map]
/// @param beside writes what goes with the maps
void write_maps(
    const MapFlags& flags, const std::vector<OccupancyGrid>& maps,
    const std::vector<WrittenMap>& written, const std::function<void()>& beside = [] {});

}  // namespace palpate::cli
