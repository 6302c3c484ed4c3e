#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

// Every reader throws Error (Fault::input) on a missing, damaged or inconsistent file, ignores
// attributes and datasets that it does not know, and refuses a higher version. Every writer throws
// Error (Fault::input) on content that no reader takes. It writes a temporary file beside the
// target and renames it, so that the target is whole or stays as it was. A failing disk
// throws Error (Fault::system), lack of memory std::bad_alloc. Messages are one line that names the
// file, the field and the remedy.

/// Read or write a "palpate.recording" HDF5 file; of an unclosed file, the whole rows are read.
PALPATE_API Recording read_recording(const std::filesystem::path& path);
PALPATE_API void write_recording(const std::filesystem::path& path, const Recording& recording);
/// Closes, in place, a recording whose FrameRecorder was killed or crashed. The complete rows stay,
/// and programs other than Palpate can then open the file like any other.
/// @returns false where the file is closed already
/// @throws Error where the file is still being recorded, or cannot be read or written; it stays
/// readable
PALPATE_API bool close_recording(const std::filesystem::path& path);

/// Read or write a "palpate.map" HDF5 file.
PALPATE_API OccupancyGrid read_map(const std::filesystem::path& path);
PALPATE_API void write_map(const std::filesystem::path& path, const OccupancyGrid& map);

/// Writes a map in the map_server format of ROS: `yaml_path`, which ends in .yaml, and beside it
/// the image, with the same stem and the ending .pgm. The mode is trinary; occupied cells are
/// black; resolution and origin are in metres; the first image row has the largest y.
PALPATE_API void write_map_server(const std::filesystem::path& yaml_path, const OccupancyGrid& map);

/// The posterior of one recording, the contents of a "palpate.posterior" HDF5 file: of every bin,
/// or of those that a search by bounds evaluated.
struct Posterior {
  std::vector<std::string> objects;
  PoseLattice lattice;
  /// In nats, without prior weights: [object, theta, y, x], or [n] of the bins in `index`.
  std::vector<double> log_likelihood;
  /// See EvaluatedBelief; nothing where the posterior is of every bin.
  std::optional<double> rest_mass_bound = {};
  std::vector<std::int64_t> index = {};  ///< [n] see EvaluatedBelief; empty for every bin
};
PALPATE_API Posterior read_posterior(const std::filesystem::path& path);
PALPATE_API void write_posterior(const std::filesystem::path& path, const Posterior& posterior);
/// Writes a posterior object by object, so that the bins of one object at a time are in memory.
/// @param log_likelihood is called once for each object in order, and returns the log-likelihood of
/// the object's bins, [theta, y, x] in nats, without prior weights
PALPATE_API void write_posterior(
    const std::filesystem::path& path, const std::vector<std::string>& objects,
    const PoseLattice& lattice,
    const std::function<std::vector<double>(std::size_t object)>& log_likelihood);

/// Returns the `format` attribute of an HDF5 file, such as "palpate.map".
PALPATE_API std::string read_format(const std::filesystem::path& path);

/// Contents of a scene file; what the file leaves out is empty here. A flag of the command line
/// overrides its key.
struct Scene {
  /// An object to recognise. Its label, symmetry and mirror, where given, override the map's own.
  struct Object {
    std::filesystem::path map;
    std::optional<std::string> label;
    std::optional<int> symmetry;  ///< n-fold; 0 = full
    std::optional<bool> mirror;   ///< OccupancyGrid::mirror
    double weight = 1.0;          ///< prior weight, relative to the other objects'
  };

  std::vector<Object> objects;
  std::optional<std::vector<glm::dvec2>> array_mm;  ///< element centres in the sensor frame
  std::optional<std::filesystem::path> array_file;  ///< file of `array_mm`, if any
  /// [option] its value, spelled as for the command's flag: {"x-mm", "-10:10"}
  std::map<std::string, std::string> options;
};

/// Reads a YAML scene file. Its relative paths start from its folder; returned paths include it.
/// `array` is "digitacts", a file as `palpate import --array` takes it, of which only the places
/// are read, or a list of [x, y] in mm.
/// @throws Error (Fault::input) naming the file, line, key, value and remedy, also on an unknown
/// key or one given twice
PALPATE_API Scene read_scene(const std::filesystem::path& path);

}  // namespace palpate
