#include "cli/sensor_model_flag.hpp"

#include <utility>

#include "cli/recognition_flags.hpp"
#include "io/input_file.hpp"

namespace palpate::cli {

namespace {

constexpr const char* taken = "the table of {} takes its place; leave it out";

/// Throws Error where Eq. 7's numbers are given.
void refuse_beside_table(const RecognitionFlags& flags, const Scene& scene,
                         const std::string& file) {
  for (const auto& [flag, given] : {std::pair{"--gamma", flags.gamma.has_value()},
                                    std::pair{"--prior", flags.prior.has_value()}}) {
    if (given) {
      refuse(flag, taken, file);
    }
  }
  for (const auto& [key, given] :
       {std::pair{"gamma", scene.gamma.has_value()}, std::pair{"prior", scene.prior.has_value()}}) {
    if (given) {
      refuse(flags.scene + ": " + key, taken, file);
    }
  }
}

}  // namespace

std::string sensor_model_file(const RecognitionFlags& flags, const Scene& scene) {
  return flags.sensor_model.empty() && scene.sensor_model ? scene.sensor_model->string()
                                                          : flags.sensor_model;
}

std::optional<LearnedSensor> sensor_model_of(const RecognitionFlags& flags, const Scene& scene,
                                             const std::string& pressure_unit,
                                             const std::string& source) {
  const std::string file = sensor_model_file(flags, scene);
  if (file.empty()) {
    return {};
  }
  LearnedSensor sensor = read_sensor_model(file);
  if (sensor.pressure_unit != pressure_unit) {
    refuse(file, "pressure_unit = {}, but {} has pressures in {}; calibrate from recordings in {}",
           sensor.pressure_unit, source, pressure_unit, pressure_unit);
  }
  if (sensor.table) {
    refuse_beside_table(flags, scene, file);
  }
  return sensor;
}

}  // namespace palpate::cli
