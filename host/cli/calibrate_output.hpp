#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "learning/sensor_calibration.hpp"

namespace palpate::cli {

/// Says, without a full stop, that touches did not tell how badly strangers fit; "" where they did,
/// or where nothing of fits was learned.
std::string unlearned_strangers(const LearnedSensor& sensor);

/// What was learned beside the defaults, and how good it is on touches that it has not seen.
/// @param touches number of touches
std::string calibration_text(const SensorCalibration& calibration, std::size_t touches);

}  // namespace palpate::cli
