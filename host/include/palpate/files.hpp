#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

// Every reader throws Error (Fault::input) in one line that names the file, the field and the
// remedy; readers ignore what they do not know and refuse a higher version. Every writer leaves a
// whole file or none: it writes beside the target and renames.

/// Reads a "palpate.recording" HDF5 file.
Recording read_recording(const std::filesystem::path& path);
void write_recording(const std::filesystem::path& path, const Recording& recording);
/// Closes a recording of FrameRecorder that was cut off, as by a kill, in its place: keeps its
/// whole rows, so that programs other than Palpate open it like any other file.
/// @returns false where it is closed already
/// @throws Error where it is being recorded, cannot be read or cannot be written; it can then be
/// read as before
bool close_recording(const std::filesystem::path& path);

/// Reads a "palpate.map" HDF5 file.
OccupancyGrid read_map(const std::filesystem::path& path);
void write_map(const std::filesystem::path& path, const OccupancyGrid& map);

/// Writes map.pgm and map.yaml in the map_server convention of ROS (trinary; occupied is black;
/// the resolution and origin in metres; the first image row is the largest y), beside each other.
/// `yaml_path` ends in .yaml; the image takes its stem.
void write_map_server(const std::filesystem::path& yaml_path, const OccupancyGrid& map);

/// The posterior of one recording, the contents of a "palpate.posterior" HDF5 file.
struct Posterior {
  std::vector<std::string> objects;
  PoseLattice lattice;
  std::vector<double> log_likelihood;  ///< [object, theta, y, x] in nats, without prior weights
};
Posterior read_posterior(const std::filesystem::path& path);
void write_posterior(const std::filesystem::path& path, const Posterior& posterior);
/// Writes a posterior object by object, so that the bins of one object at a time are in memory.
/// @param log_likelihood is called once for each object in order, and returns the log-likelihood of
/// the object's bins, [theta, y, x] in nats, without prior weights
void write_posterior(const std::filesystem::path& path, const std::vector<std::string>& objects,
                     const PoseLattice& lattice,
                     const std::function<std::vector<double>(std::size_t object)>& log_likelihood);

/// The `format` attribute of an HDF5 file, such as "palpate.map".
std::string read_format(const std::filesystem::path& path);

}  // namespace palpate
