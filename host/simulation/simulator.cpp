#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "model/moved_from.hpp"
#include "model/random.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"
#include "simulation/displacement_field.hpp"

namespace palpate {

namespace {

enum class Zero { allowed, refused };

void require(const char* field, double value, Zero zero) {
  // The bound is far beyond any sensor and keeps the arithmetic finite. NaN is refused too.
  constexpr double largest = 1e6;
  const bool above_lower_end = zero == Zero::allowed ? value >= 0.0 : value > 0.0;
  if (!above_lower_end || value > largest) {
    throw Error(Fault::input,
                fmt::format("sensor {} = {}: give a number {} 0, at most {}", field, value,
                            zero == Zero::allowed ? "from" : "above", largest));
  }
}

void validate(const SensorModel& model) {
  require("psf_mm", model.psf_mm, Zero::allowed);
  require("element_mm", model.element_mm, Zero::refused);
  require("pressure_kpa", model.pressure_kpa, Zero::refused);
  require("force_spread", model.force_spread, Zero::allowed);
  require("gain_spread", model.gain_spread, Zero::allowed);
  require("noise_kpa", model.noise_kpa, Zero::allowed);
}

void validate(const std::vector<glm::dvec2>& elements_mm) {
  if (elements_mm.empty()) {
    throw Error(Fault::input, "array without elements: give at least one position in mm");
  }
  for (std::size_t i = 0; i < elements_mm.size(); ++i) {
    const glm::dvec2& p = elements_mm[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      throw Error(Fault::input,
                  fmt::format("array element {} at {},{}: give finite numbers", i, p.x, p.y));
    }
  }
}

/// Draws a factor around 1, at least 0.1: every press has a force, every element a gain.
double random_factor(Random& random, double spread) {
  return std::max(0.1, 1.0 + spread * random.normal());
}

}  // namespace

struct Simulator::Impl {
  std::string label;
  SensorModel model;
  std::vector<glm::dvec2> elements_mm;
  DisplacementField field;
  Random random;
  std::vector<double> gains;  ///< [e]
};

Simulator::Simulator(const Shape& shape, const SensorModel& model,
                     std::vector<glm::dvec2> elements_mm, std::uint64_t seed) {
  validate(model);
  validate(elements_mm);
  impl_ = std::make_unique<Impl>(Impl{.label = shape.label,
                                      .model = model,
                                      .elements_mm = std::move(elements_mm),
                                      .field = DisplacementField(shape, model.psf_mm),
                                      .random = Random(seed, Stream::sensor),
                                      .gains = {}});
  for (std::size_t i = 0; i < impl_->elements_mm.size(); ++i) {
    impl_->gains.push_back(random_factor(impl_->random, model.gain_spread));
  }
}

Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;

Recording Simulator::touch(const std::vector<Pose>& T_robot_sensor, const Pose& T_object_robot) {
  Impl& simulator = held_by(impl_, "simulator");
  const SensorModel& model = simulator.model;
  const std::size_t e = simulator.elements_mm.size();
  Recording recording;
  recording.object = simulator.label;
  recording.T_robot_sensor = T_robot_sensor;
  recording.elements_mm = simulator.elements_mm;
  recording.pressure.reserve(T_robot_sensor.size() * e);
  recording.time_s.reserve(T_robot_sensor.size());
  for (const Pose& pose : T_robot_sensor) {
    const Pose T_object_sensor = T_object_robot * pose;
    const double force_kpa =
        model.pressure_kpa * random_factor(simulator.random, model.force_spread);
    for (std::size_t i = 0; i < e; ++i) {
      const Pose T_object_element = T_object_sensor * Pose{simulator.elements_mm[i], 0.0};
      const double pressure_kpa = force_kpa * simulator.gains[i] *
                                      simulator.field.mean(T_object_element, model.element_mm) +
                                  model.noise_kpa * simulator.random.normal();
      recording.pressure.push_back(std::max(0.0, pressure_kpa));
    }
    recording.time_s.push_back(0.5 * static_cast<double>(recording.time_s.size()));
  }
  return recording;
}

}  // namespace palpate
