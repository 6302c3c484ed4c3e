#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/random.hpp"
#include "palpate/sensor.hpp"
#include "palpate/simulation.hpp"
#include "streaming/pace.hpp"

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
class SimulatedSensor : public Sensor {
 public:
  /// @throws Error where the shape is not known
  SimulatedSensor(const std::string& shape, const SimulatedSensorOptions& options);

  const SensorDescription& description() const override { return description_; }
  void start() override;
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool ended() const override;
  void stop() override {}
  SensorCounters counters() const override { return counters_; }

 private:
  struct Press {
    Pose T_robot_sensor;
    std::vector<double> pressure_kpa;  ///< [e] in steady contact, without noise
  };

  Press draw_press();
  double stream_s() const;

  SimulatedSensorOptions options_;
  Shape shape_;
  Pose T_object_robot_;
  SensorDescription description_;
  std::vector<double> offset_kpa_;  ///< [e] readings when untouched
  Pace pace_;
  std::optional<Simulator> simulator_;
  std::optional<Random> noise_;
  std::vector<Pose> poses_;  ///< T_object_sensor still to be tried, the last first
  std::uint64_t batches_ = 0;
  std::uint64_t presses_ = 0;  ///< begun
  Press before_;
  Press press_;
  double start_s_ = 0.0;  ///< Unix time of frame 0
  std::uint64_t at_ = 0;  ///< index of the next frame
  SensorCounters counters_;
};

}  // namespace palpate
