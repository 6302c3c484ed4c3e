#include "streaming/simulated_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

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

Pose between(const Pose& a, const Pose& b, double u) {
  constexpr double turn_rad = 2.0 * std::numbers::pi;
  return {a.translation_mm + u * (b.translation_mm - a.translation_mm),
          a.theta_rad + u * wrap_angle(b.theta_rad - a.theta_rad, turn_rad)};
}

double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

SimulatedSensor::SimulatedSensor(const std::string& shape, const SimulatedSensorOptions& options)
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

void SimulatedSensor::start() {
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
  start_s_ = unix_time_s();
  pace_.start(0.0);
}

// Draws the next press that meets the shape, as a guarded move goes on where it meets nothing.
SimulatedSensor::Press SimulatedSensor::draw_press() {
  constexpr double least_kpa = 5.0;
  constexpr int batch = 256;
  Press press;
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

double SimulatedSensor::stream_s() const { return static_cast<double>(at_) / options_.rate_hz; }

bool SimulatedSensor::ended() const {
  return options_.touches &&
         stream_s() > hover_s + static_cast<double>(*options_.touches) * cycle_s + farewell_s;
}

std::optional<Frame> SimulatedSensor::next(std::chrono::milliseconds timeout) {
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

}  // namespace palpate
