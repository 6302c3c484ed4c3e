#pragma once

#include <string>

#include "palpate/learned_sensor.hpp"

namespace palpate::cli {

/// What a sensor model says, a line for each part that it has.
std::string sensor_model_text(const LearnedSensor& sensor);

}  // namespace palpate::cli
