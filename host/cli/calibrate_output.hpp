#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "figures/figures.hpp"
#include "learning/sensor_calibration.hpp"

namespace palpate::cli {

/// Says, without a full stop, that touches at known poses did not tell how badly strangers fit; ""
/// where they did, or where nothing of fits was learned.
std::string unlearned_strangers(const LearnedSensor& sensor);

/// What was learned beside the defaults, and how good it is on touches that it has not seen.
/// @param touches number of touches
std::string calibration_text(const SensorCalibration& calibration, std::size_t touches);

/// Draws how likely each level of reading is over what a map says, beside Eq. 7, and returns the
/// bytes of a PNG file.
std::string draw_table(const LearnedSensor& sensor);

/// Accuracy over confidence before and after.
/// @param calibration of two objects or more
ReliabilityFigure reliability_of(const SensorCalibration& calibration);

}  // namespace palpate::cli
