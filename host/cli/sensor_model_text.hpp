#pragma once

#include <string>

#include "palpate/learned_sensor.hpp"

namespace palpate::cli {

/// "0.8 x 0.8 mm x 22.5 deg"
std::string steps_text(const BinSteps& steps);

/// What a sensor model says, a line for each part that it has.
std::string sensor_model_text(const LearnedSensor& sensor);

}  // namespace palpate::cli
