#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "palpate/balanced_lattice.hpp"
#include "palpate/files.hpp"
#include "palpate/particle_filter.hpp"

namespace palpate {

/// Asks for what follows from the maps and the touches.
struct Automatic {
  friend bool operator==(const Automatic&, const Automatic&) = default;
};

enum class FilterKind { automatic, histogram, bounded, particles };

using Bins = std::variant<std::array<int, 3>, BinWidth>;  ///< counts of x, y and theta
using Range = std::array<double, 2>;                      ///< lower and upper end
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
/// is empty. options() says of each option how it is spelled and which values it takes.
struct Request {
  std::vector<std::string> maps;     ///< files, and folders of them
  std::vector<GivenMap> given_maps;  ///< in the place of `maps`
  std::string scene;                 ///< a file; complete() reads it
  std::string sensor_model;          ///< a file, or no_sensor_model; "": that of the maps' folder
  std::optional<Bins> bins;
  std::optional<Range> x_mm;
  std::optional<Range> y_mm;
  std::optional<Range> theta_deg;
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

}  // namespace palpate
