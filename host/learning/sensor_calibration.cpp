#include "sensor_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "cross_validation.hpp"
#include "element_spacing.hpp"
#include "feature_learning.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Shares of the time that a calibration takes.
constexpr double table_share = 0.4;
constexpr double validation_share = 0.3;  ///< of Eq. 7, and of the table

std::vector<double> contact_pressures(const std::vector<Press>& presses,
                                      const ContactClassifier& classifier) {
  std::vector<double> pressures;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      const std::vector<Reading> readings = classifier.classify(touch);
      for (std::size_t e = 0; e < readings.size(); ++e) {
        if (is_contact(readings[e])) {
          pressures.push_back(touch.pressure[e]);
        }
      }
    }
  }
  std::ranges::sort(pressures);
  return pressures;
}

/// The largest spacing of the presses' arrays.
double spacing_mm(const std::vector<Press>& presses, double without) {
  double largest = 0.0;
  for (const Press& press : presses) {
    if (const auto spacing = spacing_of(press.touches.front().elements_mm)) {
      largest = std::max(largest, spacing->nearest_mm.most);
    }
  }
  return largest > 0.0 ? largest : without;
}

TableLearning learning_of(const std::vector<Press>& presses,
                          const SensorCalibrationOptions& options) {
  constexpr double near = 2.0;  // in spacings of the elements
  constexpr double far = 6.0;
  const double spacing = spacing_mm(presses, 2.0 * options.map.sensor.spread_mm);
  const std::vector<double> pressures = contact_pressures(presses, options.map.classifier);
  TableLearning how;
  if (options.layer == MapLayer::mean_level) {
    how.layer = mean_level_layer(options.map.classifier.threshold,
                                 pressures.empty() ? 0.0 : pressures.back());
  }
  how.layer.near_mm = near * spacing;
  how.layer.far_mm = far * spacing;
  how.level_edges = level_edges_of(presses, options.map.classifier, options.levels);
  how.contact = {.classifier = options.map.classifier,
                 .gamma = options.gamma,
                 .prior = options.map.sensor.prior};
  how.lattice = placing_lattice(presses, options.step_mm, options.step_rad);
  return how;
}

/// Calibration of presses whose temperature and weight come from the other half of them.
Calibration validated(const std::vector<ScoredPress>& presses) {
  std::vector<ScoredPress> tempered;
  for (std::size_t half = 0; half < 2; ++half) {
    std::vector<ScoredPress> others;
    for (std::size_t i = 0; i < presses.size(); ++i) {
      if (i % 2 != half) {
        others.push_back(presses[i]);
      }
    }
    if (others.empty()) {
      others = presses;
    }
    const TemperatureFit fit = fit_temperature(others);
    for (std::size_t i = half; i < presses.size(); i += 2) {
      ScoredPress press{.truth = presses[i].truth, .log_evidence = {}, .log_density = {}};
      for (const double p : label_probabilities(presses[i], fit.temperature, fit.feature_weight)) {
        press.log_evidence.push_back(std::log(p));
      }
      tempered.push_back(std::move(press));
    }
  }
  return calibration_of(tempered, 1.0);
}

}  // namespace

std::vector<double> level_edges_of(const std::vector<Press>& presses,
                                   const ContactClassifier& classifier, std::size_t levels) {
  const std::vector<double> pressures = contact_pressures(presses, classifier);
  std::vector<double> edges;
  for (std::size_t level = 2; level < levels && !pressures.empty(); ++level) {
    const double edge = pressures[(level - 1) * pressures.size() / (levels - 1)];
    if (edge > (edges.empty() ? pressures.front() : edges.back())) {
      edges.push_back(edge);
    }
  }
  return edges;
}

SensorCalibration calibrate_sensor(const std::vector<Press>& presses,
                                   const SensorCalibrationOptions& options,
                                   const std::function<void(double)>& progress) {
  if (options.levels < 2 || options.levels > most_reading_levels) {
    throw Error(Fault::input,
                fmt::format("levels = {}: give 2 to {}", options.levels, most_reading_levels));
  }
  const auto part = [&](double begin, double share) {
    return [&progress, begin, share](double fraction) {
      if (progress) {
        progress(begin + share * fraction);
      }
    };
  };
  const std::vector<OccupancyGrid> maps = press_maps(presses, options.map);
  const TableLearning how = learning_of(presses, options);
  const PlacedPresses placed = learn_table(presses, maps, how, part(0.0, table_share));

  SensorCalibration result;
  std::set<std::string> labels;
  std::vector<LabelledFeatures> features;
  for (const Press& press : presses) {
    labels.insert(press.label);
    features.push_back(
        {press.label, press_features(press.touches.front(), options.map.classifier)});
  }
  result.objects = labels.size();
  result.sensor = {.pressure_unit = options.pressure_unit,
                   .classifier = options.map.classifier,
                   .gamma = options.gamma,
                   .prior = options.map.sensor.prior,
                   .spread_mm = options.map.sensor.spread_mm,
                   .table = placed.table};
  if (labels.size() < 2) {
    result.warnings.emplace_back(
        "presses of one object say nothing about confidence: the temperature stays 1, and neither "
        "features nor familiarity are learned; give presses of two objects or more");
    return result;
  }
  const CrossValidationOptions folds{.folds = options.folds, .maps_per_object = options.most_maps};
  const CrossValidation eq7 =
      cross_validate(presses, maps, how, nullptr, folds, part(table_share, validation_share));
  const CrossValidation learned =
      cross_validate(presses, maps, how, &placed, folds,
                     part(table_share + validation_share, 1.0 - table_share - validation_share));
  result.before = calibration_of(eq7.presses, 1.0);
  result.table = calibration_of(learned.presses, 1.0);
  result.after = validated(learned.presses);
  const TemperatureFit fit = fit_temperature(learned.presses);
  result.sensor.temperature = fit.temperature;
  result.sensor.features = learn_features(features);
  result.sensor.features->weight = fit.feature_weight;
  const FamiliarityScores scores{learned.known, learned.unknown};
  result.sensor.familiarity = fit_familiarity(scores);
  result.area_under_curve = area_under_curve(scores);
  return result;
}

}  // namespace palpate
