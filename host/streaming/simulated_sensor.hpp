#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/pose.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// What a simulated robot does: see open_virtual_sensor().
struct SimulatedSensorOptions {
  double rate_hz = 100.0;
  std::vector<glm::dvec2> elements_mm;  ///< in the sensor frame; empty: digitacts_array()
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> touches;  ///< none: without end
  double noise_kpa = 0.7;
  std::optional<Pose> T_object_robot;  ///< none: the object is known
  std::optional<double> speed = 1.0;   ///< times real time; none: at once
};

/// Simulates a robot that presses an array onto a shape again and again.
/// @throws Error where the shape is not known
std::unique_ptr<Sensor> make_simulated_sensor(const std::string& shape,
                                              const SimulatedSensorOptions& options);

}  // namespace palpate
