#pragma once

#include <optional>
#include <string>

#include "palpate/learned_sensor.hpp"
#include "palpate/scene.hpp"

namespace palpate::cli {

struct RecognitionFlags;

/// The file of the sensor model that the flag or the scene names; the flag overrides the scene's
/// key. "" where neither does.
std::string sensor_model_file(const RecognitionFlags& flags, const Scene& scene);

/// Reads that file, if there is one. Throws Error where it cannot be read, is for another pressure
/// unit, or has a table in the place of a gamma or prior that is given.
/// @param pressure_unit of the touches to come, which `source` gives
std::optional<LearnedSensor> sensor_model_of(const RecognitionFlags& flags, const Scene& scene,
                                             const std::string& pressure_unit,
                                             const std::string& source);

}  // namespace palpate::cli
