#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "press.hpp"
#include "temperature_fit.hpp"

namespace palpate {

/// What a calibration from presses at unknown poses starts from.
struct SensorCalibrationOptions {
  std::string pressure_unit = "kPa";
  MapOptions map;      ///< of each press; its classifier and its prior are those of Eq. 7
  double gamma = 0.1;  ///< of Eq. 7
  MapLayer layer = MapLayer::mean_level;
  std::size_t levels = 7;     ///< of readings, No Contact included; at least 2
  double step_mm = 2.0;       ///< of the poses at which presses are placed
  double step_rad = 0.1745;   ///< 10 degrees
  std::size_t folds = 5;      ///< of the cross-validation
  std::size_t most_maps = 5;  ///< of an object, in the cross-validation
};

/// A learned sensor and how good it is on presses that it has not seen.
struct SensorCalibration {
  LearnedSensor sensor;
  std::size_t objects = 0;
  Calibration before;  ///< Eq. 7, temperature 1
  Calibration table;   ///< the table, temperature 1
  Calibration after;   ///< the table, temperature and features
  /// Area under the curve of presses whose object is known against those whose object is left out;
  /// none with one object.
  std::optional<double> area_under_curve;
  std::vector<std::string> warnings;  ///< what could not be learned, in whole sentences
};

/// Learns the table, the temperature, the features' distributions with their weight, and the
/// familiarity. What one object cannot tell (temperature, weight, familiarity) keeps its default,
/// with a warning. The numbers before and after are of cross-validation; `after` gives each half of
/// the presses the temperature and weight of the other half. Takes all host threads.
/// @throws Error where no object has two presses, on levels out of range, and as press_maps() and
/// learn_table() do; what `progress` throws
SensorCalibration calibrate_sensor(const std::vector<Press>& presses,
                                   const SensorCalibrationOptions& options,
                                   const std::function<void(double)>& progress = {});

/// Pressures that part the elements In Contact of all presses into `levels` - 1 levels of about as
/// many elements each; fewer where pressures are the same.
std::vector<double> level_edges_of(const std::vector<Press>& presses,
                                   const ContactClassifier& classifier, std::size_t levels);

}  // namespace palpate
