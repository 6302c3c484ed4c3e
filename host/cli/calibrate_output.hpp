#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "learning/sensor_calibration.hpp"

namespace palpate::cli {

/// What was learned beside the defaults, and how good it is on touches that it has not seen.
/// @param touches number of touches
std::string calibration_text(const SensorCalibration& calibration, std::size_t touches);

}  // namespace palpate::cli
