#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"

namespace palpate {

/// Contents of a scene file; a key that the file leaves out is empty here. A flag of the command
/// line overrides its key.
struct Scene {
  /// An object to recognise. Its label, symmetry and mirror, where given, override the map's own.
  struct Object {
    std::filesystem::path map;
    std::optional<std::string> label;
    std::optional<int> symmetry;  ///< n-fold; 0 = full
    std::optional<bool> mirror;   ///< OccupancyGrid::mirror
    double weight = 1.0;          ///< prior weight, relative to the other objects'
  };

  /// Ranges [lower, upper] of the lattice over T_object_robot, and its pivot; see PoseLattice.
  struct Region {
    std::optional<std::array<double, 2>> x_mm;
    std::optional<std::array<double, 2>> y_mm;
    std::optional<std::array<double, 2>> theta_deg;
    std::optional<glm::dvec2> pivot_mm;  ///< in the robot frame
    bool auto_pivot = false;             ///< pivot_mm is "auto": where the unknown is first felt
  };

  /// Standard deviations of a displacement; see DisplacementSd.
  struct Displacement {
    std::optional<double> mm;
    std::optional<double> deg;
  };

  std::optional<std::vector<glm::dvec2>> array_mm;    ///< element centres in the sensor frame
  std::optional<std::filesystem::path> array_file;    ///< file of `array_mm`, if any
  std::optional<std::filesystem::path> sensor_model;  ///< file of a LearnedSensor, or "none"
  std::optional<double> threshold;                    ///< in the recording's pressure unit
  std::optional<double> ratio;                        ///< of Eq. 3
  std::optional<double> gamma;                        ///< of Eq. 7
  std::optional<double> prior;                        ///< p(m) of Eq. 7
  std::vector<Object> objects;
  Region region;
  std::optional<double> none;              ///< prior weight of "none of these"
  bool auto_none = false;                  ///< the weight is "auto": a ninth of all maps' weights
  Displacement touch_sd;                   ///< HistogramOptions::touch_sd
  Displacement slip_sd;                    ///< HistogramOptions::slip_sd
  std::optional<std::array<int, 3>> bins;  ///< of x, y, theta
  bool auto_bins = false;                  ///< counts by balanced_lattice()
  bool fine_bins = false;                  ///< counts by balanced_lattice() with BinWidth::fine
  std::optional<std::string> filter;       ///< "auto", "histogram", "bounded" or "particles"
  std::optional<double> act_below_mm;      ///< see "decision" in docs/how_sure.md
  std::optional<double> act_above;         ///< a probability
  std::optional<std::string> device;       ///< a device's name or index
};

/// Reads a YAML scene file. Its relative paths start from its folder; returned paths include it.
/// `array` is "digitacts", a file as `palpate import --array` takes it, of which only the places
/// are read, or a list of [x, y] in mm.
/// @throws Error (Fault::input) naming the file, line, key, value and remedy, also on an unknown
/// key or one given twice
PALPATE_API Scene read_scene(const std::filesystem::path& path);

}  // namespace palpate
