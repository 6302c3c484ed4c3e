#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "terminal_canvas.hpp"

namespace palpate::cli {

/// What `live` shows.
struct LiveView {
  std::string sensor;
  double rate_hz = 0.0;
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;
  std::optional<double> latency_ms;
  std::optional<double> worst_latency_ms;
  std::string state;     ///< what goes on, in a few words
  bool warning = false;  ///< and that it is not as it should be
  std::string keys;      ///< which keys do what

  std::vector<glm::dvec2> elements_mm;  ///< [e] in the sensor frame
  std::vector<std::uint8_t> valid;      ///< empty or [e]
  std::vector<double> pressure;  ///< [e] now, above the baseline, NaN: Unknown; empty: none yet
  double full_scale = 1.0;       ///< pressure of the brightest colour
  std::string pressure_unit;

  std::vector<std::string> labels;
  std::vector<double> identity;  ///< [label] probability; empty: no touch yet

  const OccupancyGrid* map = nullptr;  ///< of the object where the mode lies; none: no touch yet
  double evidence_nats = 1.0;          ///< of the strongest colour
  Pose T_object_robot;

  /// The array on the object: now, or at the last touch.
  std::optional<Pose> T_robot_sensor;
  std::vector<Reading> readings;  ///< [e], with T_robot_sensor
};

/// The view in as many lines as `rows`, none longer than `columns`. Pictures are left out where
/// there is no room for them.
std::vector<std::string> draw(const LiveView& view, int columns, int rows, TerminalColours colours);

}  // namespace palpate::cli
