#include "learning/touch_sd_learning.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "learning/training_maps.hpp"

namespace palpate {

namespace {

constexpr std::size_t folds = 5;
constexpr std::size_t touches_of_unknown = 8;
constexpr std::size_t fewest_touches = 5;  ///< of an unknown: one pose explains two touches
constexpr std::size_t fewest_unknowns = 5;

/// Poses so near to the known one, 0, that displacements of the search's start explain them.
PoseLattice about_known_pose(const DisplacementSd& start) {
  constexpr double sd = 4.0;
  constexpr double steps_per_sd = 1.0 / 0.6;
  const auto axis = [&](double deviation) {
    return Axis{-sd * deviation, sd * deviation,
                static_cast<int>(std::ceil(2.0 * sd * steps_per_sd))};
  };
  return {.x_mm = axis(start.mm), .y_mm = axis(start.mm), .theta_rad = axis(start.rad)};
}

/// The touches of the first fold, some of an object at a time.
std::vector<TouchedObject> unknowns_of(const std::vector<Press>& presses) {
  const std::vector<std::size_t> fold = folds_of(presses, folds);
  std::map<std::string, std::vector<Touch>> touches;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (fold[i] == 0) {
      Touch touch = presses[i].touches.front();
      touch.T_robot_sensor = *presses[i].T_object_robot * touch.T_robot_sensor;
      touches[presses[i].label].push_back(touch);
    }
  }
  std::vector<TouchedObject> unknowns;
  for (const auto& [label, own] : touches) {
    // Every k-th touch is of one unknown, so that each was touched in many places.
    const std::size_t count = std::max<std::size_t>(1, own.size() / touches_of_unknown);
    for (std::size_t first = 0; first < count; ++first) {
      TouchedObject unknown{.name = label, .touches = {}, .label = label};
      for (std::size_t i = first; i < own.size(); i += count) {
        unknown.touches.push_back(own[i]);
      }
      unknowns.push_back(std::move(unknown));
    }
  }
  return unknowns;
}

}  // namespace

std::optional<DisplacementSd> learn_touch_sd(Device& device, const std::vector<Press>& presses,
                                             const LearnedSensor& sensor, const MapOptions& maps,
                                             const std::function<void(double)>& progress) {
  std::vector<Hypothesis> hypotheses;
  std::vector<TouchedObject> unknowns = unknowns_of(presses);
  const std::vector<std::size_t> fold = folds_of(presses, folds);
  for (TrainingMap& map : maps_without_folds(presses, maps, folds)) {
    const bool without_first =
        std::ranges::none_of(map.presses, [&](std::size_t press) { return fold[press] == 0; });
    if (without_first) {
      hypotheses.push_back({.map = std::move(map.map)});
    }
  }
  std::erase_if(unknowns, [&](const TouchedObject& unknown) {
    return unknown.touches.size() < fewest_touches ||
           std::ranges::none_of(hypotheses, [&](const Hypothesis& hypothesis) {
             return hypothesis.map.label == unknown.label;
           });
  });
  if (unknowns.size() < fewest_unknowns) {
    return {};
  }
  const TouchSdFitOptions options;
  HistogramOptions histogram{.lattice = about_known_pose(options.start)};
  histogram.contact = {
      .classifier = sensor.classifier, .gamma = ContactModel{}.gamma, .prior = sensor.prior};
  const RecognitionTask task(std::move(hypotheses), histogram);
  const TouchSdFit fit = fit_touch_sd(device, task, unknowns, options, progress);
  const auto distinct = [](double sd, double error, double resolution) {
    return sd > std::max(2.0 * error, resolution) ? sd : 0.0;
  };
  return DisplacementSd{distinct(fit.sd.mm, fit.standard_error.mm, fit.resolution.mm),
                        distinct(fit.sd.rad, fit.standard_error.rad, fit.resolution.rad)};
}

}  // namespace palpate
