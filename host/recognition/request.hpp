#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "palpate/balanced_lattice.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/scene.hpp"

namespace palpate {

/// Asks for what follows from the maps and the touches.
struct Automatic {};

enum class FilterKind { automatic, histogram, bounded, particles };
std::string name_of(FilterKind kind);

/// @throws Error where there is no such filter; "auto" is FilterKind::automatic
FilterKind filter_named(const std::string& name);
/// @throws Error where particles are not drawn so
Resampling resampling_named(const std::string& name);

using Bins = std::variant<std::array<int, 3>, BinWidth>;  ///< counts of x, y and theta
using Pivot = std::variant<glm::dvec2, Automatic>;        ///< in the robot frame, mm
using NoneWeight = std::variant<double, Automatic>;       ///< automatic: one in ten

/// Touches [begin, end) of a recording.
struct Frames {
  std::size_t begin = 0;
  std::size_t end = 0;

  friend bool operator==(const Frames&, const Frames&) = default;
};

/// A map in memory, and its name for messages.
struct GivenMap {
  std::string name;
  Hypothesis hypothesis;
};

/// Request::sensor_model that stands for Eq. 7.
inline constexpr const char* no_sensor_model = "none";

/// What is asked of a recognition, by the command line, a scene file or a program; what is left out
/// is empty. resolve() makes it a task and throws Error where a value cannot be meant. Messages
/// name an option by its member here, with dashes: `x-mm`.
struct Request {
  std::vector<std::string> maps;     ///< files, and folders of them
  std::vector<GivenMap> given_maps;  ///< in the place of `maps`
  std::string scene;                 ///< a file; complete() reads it
  std::string sensor_model;          ///< a file, or no_sensor_model; "": that of the maps' folder
  std::optional<Bins> bins;
  std::optional<std::array<double, 2>> x_mm;  ///< range
  std::optional<std::array<double, 2>> y_mm;
  std::optional<std::array<double, 2>> theta_deg;
  std::optional<Pivot> pivot_mm;
  std::optional<double> prior;
  std::optional<double> gamma;
  std::optional<double> threshold;
  std::optional<double> ratio;
  std::optional<double> touch_sd_mm;
  std::optional<double> touch_sd_deg;
  std::optional<double> slip_sd_mm;
  std::optional<double> slip_sd_deg;
  std::optional<NoneWeight> none;
  std::optional<FilterKind> filter;
  std::optional<double> tolerance;
  std::optional<double> budget_ms;
  std::optional<double> evidence_nats;
  std::optional<double> act_below_mm;
  std::optional<double> act_above;
  std::optional<int> particles;
  std::optional<Resampling> resampling;
  bool augmented = false;
  std::optional<std::uint64_t> seed;
  std::string device;

  // Which touches of a recording make an unknown.
  std::optional<Frames> frames;
  std::optional<int> touches;  ///< the first so many
  bool each_frame = false;     ///< every touch is an unknown of its own
  bool trace = false;          ///< the record has a step for every touch

  // What only a scene file gives.
  std::vector<Scene::Object> objects;  ///< where there are no maps
  std::optional<std::vector<glm::dvec2>> array_mm;
  std::optional<std::filesystem::path> array_file;
  std::map<std::string, std::string> keys;  ///< [option] the scene's key that gave it
};

/// The request with all that it leaves out and its scene file gives. @throws Error
Request complete(Request request);

/// The objects to recognise, by their files, or by the names of the maps in memory.
/// @throws Error where there are none, or a folder has no maps
std::vector<Scene::Object> objects_of(const Request& request);

/// The files that the task depends on, after the options that name them: the scene, its array, the
/// sensor model, the maps with the sensor models beside them. @throws Error as objects_of() does
std::vector<std::pair<std::string, std::filesystem::path>> files_of(const Request& request);

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

}  // namespace palpate
