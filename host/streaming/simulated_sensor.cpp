#include "streaming/simulated_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "model/random.hpp"
#include "model/stream_time.hpp"
#include "palpate/simulation.hpp"
#include "streaming/pose_between.hpp"

namespace palpate {

namespace {

// Phases of the robot's motion, in s.
constexpr double hover_s = 1.0;
constexpr double travel_s = 0.3;
constexpr double ramp_s = 0.1;
constexpr double steady_s = 0.5;
constexpr double cycle_s = travel_s + ramp_s + steady_s + ramp_s;
// Frames go on for this long after the last press, so that its release is seen.
constexpr double farewell_s = 0.6;

constexpr double offset_kpa = 3.0;
constexpr double offset_spread_kpa = 0.5;

// Rises from 0 to 1 for u in [0, 1] with zero slope at both ends, where an arm stands still.
double smooth_step(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * (3.0 - 2.0 * u);
}

// Returns the part of the full force `t` seconds into a press.
double force_at(double t) {
  return smooth_step((t - travel_s) / ramp_s) -
         smooth_step((t - travel_s - ramp_s - steady_s) / ramp_s);
}

/// Simulates a robot that presses an array onto a shape again and again.
class SimulatedSensor : public Sensor {
 public:
  /// @throws Error where the shape is not known
  SimulatedSensor(const std::string& shape, const SimulatedSensorOptions& options)
      : options_(options),
        shape_(make_shape(shape)),
        T_object_robot_(options.T_object_robot.value_or(Pose{})),
        pace_(options.speed) {
    const bool own_array = !options.elements_mm.empty();
    description_.name = own_array ? "simulated array" : "simulated DigiTacts";
    description_.elements_mm = own_array ? options.elements_mm : digitacts_array();
    description_.rate_hz = options.rate_hz;
    if (options.T_object_robot) {
      description_.truth = {.object = shape_.label, .T_object_robot = T_object_robot_};
    } else {
      description_.object = shape_.label;
    }
    start();
  }

  const SensorDescription& description() const override { return description_; }

  void start() override {
    SensorModel model;
    model.noise_kpa = 0.0;  // every frame adds its own
    simulator_.emplace(shape_, model, description_.elements_mm, options_.seed);
    noise_.emplace(options_.seed, Stream::frames);
    offset_kpa_.clear();
    for (std::size_t i = 0; i < description_.elements_mm.size(); ++i) {
      offset_kpa_.push_back(offset_kpa + offset_spread_kpa * noise_->normal());
    }
    poses_.clear();
    batches_ = 0;
    press_ = draw_press();
    before_ = press_;
    presses_ = 1;
    at_ = 0;
    counters_ = {};
    start_s_ = host_clock_s();
    pace_.start(0.0);
  }

  std::optional<Frame> next(std::chrono::milliseconds timeout) override {
    const double time_s = stream_s();
    if (ended() || !pace_.wait(time_s, timeout)) {
      return {};
    }
    ++at_;
    ++counters_.frames;
    while (time_s - hover_s >= static_cast<double>(presses_) * cycle_s &&
           (!options_.touches || presses_ < *options_.touches)) {
      before_ = std::exchange(press_, draw_press());
      ++presses_;
    }
    const double cycle = time_s - hover_s - static_cast<double>(presses_ - 1) * cycle_s;
    const double force = force_at(cycle);
    Frame frame{.host_time_s = start_s_ + time_s,
                .values = {},
                .T_robot_sensor = between(before_.T_robot_sensor, press_.T_robot_sensor,
                                          smooth_step(cycle / travel_s))};
    for (std::size_t i = 0; i < offset_kpa_.size(); ++i) {
      const double pressure_kpa =
          offset_kpa_[i] + force * press_.pressure_kpa[i] + options_.noise_kpa * noise_->normal();
      frame.values.push_back(std::max(0.0, pressure_kpa));
    }
    return frame;
  }

  bool ended() const override {
    return options_.touches &&
           stream_s() > hover_s + static_cast<double>(*options_.touches) * cycle_s + farewell_s;
  }

  void stop() override {}
  SensorCounters counters() const override { return counters_; }

 private:
  struct SimulatedPress {
    Pose T_robot_sensor;
    std::vector<double> pressure_kpa;  ///< [e] in steady contact, without noise
  };

  // Draws the next press that meets the shape, as a guarded move goes on where it meets nothing.
  SimulatedPress draw_press() {
    constexpr double least_kpa = 5.0;
    constexpr int batch = 256;
    SimulatedPress press;
    // After so many misses, the robot presses where it is.
    for (int tries = 0; tries < 1000; ++tries) {
      if (poses_.empty()) {
        poses_ = random_poses(batch, options_.seed + batches_++);
        std::reverse(poses_.begin(), poses_.end());
      }
      press.T_robot_sensor = inverse(T_object_robot_) * poses_.back();
      poses_.pop_back();
      press.pressure_kpa = simulator_->touch({press.T_robot_sensor}, T_object_robot_).pressure;
      if (*std::max_element(press.pressure_kpa.begin(), press.pressure_kpa.end()) >= least_kpa) {
        break;
      }
    }
    return press;
  }

  double stream_s() const { return static_cast<double>(at_) / options_.rate_hz; }

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
  std::uint64_t presses_ = 0;  ///< presses that have begun
  SimulatedPress before_;
  SimulatedPress press_;
  double start_s_ = 0.0;  ///< Unix time of frame 0
  std::uint64_t at_ = 0;  ///< index of the next frame
  SensorCounters counters_;
};

}  // namespace

std::unique_ptr<Sensor> make_simulated_sensor(const std::string& shape,
                                              const SimulatedSensorOptions& options) {
  return std::make_unique<SimulatedSensor>(shape, options);
}

}  // namespace palpate
