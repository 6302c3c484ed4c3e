#include "palpate/learned_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"
#include "palpate/sensor_model.hpp"

namespace palpate {

namespace {

template <typename Value>
[[noreturn]] void refuse(const char* field, const Value& value, const char* remedy) {
  throw Error(Fault::input, fmt::format("sensor model: {} = {}: {}", field, value, remedy));
}

bool is_positive(double x) { return x > 0.0 && std::isfinite(x); }
bool from_0(double x) { return x >= 0.0 && std::isfinite(x); }

/// The matrix of correlations; none where it is not positive definite.
std::optional<glm::dmat3> correlations_of(const FeatureDistribution& distribution) {
  const auto [area_force, area_peak, force_peak] = distribution.correlation;
  const glm::dmat3 all(1.0, area_force, area_peak,   //
                       area_force, 1.0, force_peak,  //
                       area_peak, force_peak, 1.0);
  const bool definite = 1.0 - area_force * area_force > 0.0 && glm::determinant(all) > 0.0;
  return definite ? std::optional(all) : std::nullopt;
}

/// @param numbers [level, node] of a learned table with so many nodes
void require_log_probabilities(std::span<const double> numbers, std::size_t nodes) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!(numbers[i] <= 0.0)) {
      refuse(fmt::format("table: number [{}, {}]", i / nodes, i % nodes).c_str(), numbers[i],
             "give the log of a probability, 0 or less");
    }
  }
}

void require_sound(const FeatureDistribution& distribution) {
  for (std::size_t i = 0; i < PressFeatures::count; ++i) {
    if (!std::isfinite(distribution.mean[i])) {
      refuse("features: mean", distribution.mean[i], "give a number");
    }
    if (!is_positive(distribution.sd[i])) {
      refuse("features: sd", distribution.sd[i], "give a positive number");
    }
  }
  if (!correlations_of(distribution)) {
    refuse("features: correlation", fmt::format("[{}]", fmt::join(distribution.correlation, ", ")),
           "give correlations that a distribution can have");
  }
}

}  // namespace

LikelihoodTable table_of(const LearnedTable& table, std::vector<double> log_likelihood) {
  return {.first_log_odds = ReadingLayer::first_node,
          .last_log_odds = ReadingLayer::largest_value,
          .nodes = ReadingLayer::nodes,
          .level_edges = table.level_edges,
          .log_likelihood = std::move(log_likelihood)};
}

PressFeatures press_features(const Touch& touch, const ContactClassifier& classifier) {
  return features_of(TouchEvidence(touch, {.classifier = classifier}), classifier.threshold);
}

PressFeatures features_of(const TouchEvidence& touch, double threshold) {
  if (!(threshold > 0.0)) {
    throw Error(Fault::input, "threshold = 0: press features need one above 0");
  }
  const double peak = std::max(0.0, touch.largest_pressure / threshold);
  return {
      {std::log1p(static_cast<double>(touch.contacts)), std::log1p(touch.force), std::log1p(peak)}};
}

double FeatureDistribution::log_density(const PressFeatures& features) const {
  const std::optional<glm::dmat3> correlations = correlations_of(*this);
  if (!correlations) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double nats = -0.5 * std::log(glm::determinant(*correlations));
  glm::dvec3 z{};  // of unit variance
  for (int i = 0; i < z.length(); ++i) {
    const auto feature = static_cast<std::size_t>(i);
    z[i] = (features.values[feature] - mean[feature]) / sd[feature];
    nats -= std::log(sd[feature]) + 0.5 * std::log(2.0 * std::numbers::pi);
  }
  return nats - 0.5 * glm::dot(z, glm::inverse(*correlations) * z);
}

void apply(const LearnedSensor& sensor, std::vector<Hypothesis>& hypotheses,
           ContactModel& contact) {
  sensor.validate();
  std::vector<std::optional<OccupancyGrid>> layers(hypotheses.size());
  std::optional<LikelihoodTable> numbers;
  if (sensor.table) {
    const LearnedTable& table = *sensor.table;
    std::vector<double> of_each;
    bool any_own = false;
    for (std::size_t i = 0; i < hypotheses.size(); ++i) {
      layers[i] = reading_layer(hypotheses[i].map, table.layer);
      const auto own = table.objects.find(hypotheses[i].map.label);
      const bool has_own = own != table.objects.end();
      const std::vector<double>& set = has_own ? own->second : table.shared;
      of_each.insert(of_each.end(), set.begin(), set.end());
      any_own = any_own || has_own;
    }
    numbers = table_of(table, any_own ? of_each : table.shared);
    contact.prior.reset();
  }
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    hypotheses[i].layer = std::move(layers[i]);
  }
  contact.classifier = sensor.classifier;
  contact.gamma = sensor.gamma;
  contact.table = std::move(numbers);
}

void LearnedSensor::validate() const {
  if (pressure_unit != "kPa" && pressure_unit != "raw") {
    refuse("pressure_unit", pressure_unit, "give kPa or raw");
  }
  classifier.validate();
  if (!from_0(noise)) {
    refuse("noise", noise, "give a number from 0");
  }
  if (!(gamma >= 0.0 && gamma < 1.0)) {
    refuse("gamma", gamma, "give a number in [0, 1)");
  }
  if (!(prior >= least_prior && prior <= 1.0 - least_prior)) {
    refuse("prior", prior, "give a probability from 1e-6 to 1 - 1e-6");
  }
  if (!(spread_mm >= least_length_mm && spread_mm <= most_length_mm)) {
    refuse("spread_mm", spread_mm, "give a length from 1e-6 to 1e6");
  }
  if (!from_0(touch_sd.mm) || !from_0(touch_sd.rad)) {
    refuse("touch_sd", from_0(touch_sd.mm) ? touch_sd.rad : touch_sd.mm, "give numbers from 0");
  }
  if (!is_positive(temperature)) {
    refuse("temperature", temperature, "give a positive number");
  }
  if (!from_0(temperature_growth)) {
    refuse("temperature_growth", temperature_growth, "give a number from 0");
  }
  if (bins) {
    for (const double step : {bins->x_mm, bins->y_mm, bins->theta_rad}) {
      if (!from_0(step)) {
        refuse("bins", step, "give steps from 0");
      }
    }
  }
  if (table) {
    table->layer.validate();
    table_of(*table, table->shared).validate();
    require_log_probabilities(table->shared, ReadingLayer::nodes);
    for (const auto& [label, own] : table->objects) {
      if (own.size() != table->shared.size()) {
        refuse("table: numbers", own.size(), "give as many to every object as to all together");
      }
      table_of(*table, own).validate();
      require_log_probabilities(own, ReadingLayer::nodes);
    }
  }
  if (features) {
    if (!from_0(features->weight)) {
      refuse("features: weight", features->weight, "give a number from 0");
    }
    require_sound(features->any);
    for (const auto& [label, own] : features->objects) {
      require_sound(own);
    }
  }
  if (fit_scale && !std::isfinite(fit_scale->mean)) {
    refuse("fit_scale: mean", fit_scale->mean, "give a number");
  }
  if (fit_scale && !is_positive(fit_scale->sd)) {
    refuse("fit_scale: sd", fit_scale->sd, "give a positive number");
  }
  if (pose_scale && !is_positive(pose_scale->factor)) {
    refuse("pose_scale: factor", pose_scale->factor, "give a positive number");
  }
  if (pose_scale && !from_0(pose_scale->map_sd_mm)) {
    refuse("pose_scale: map_sd_mm", pose_scale->map_sd_mm, "give a number from 0");
  }
  if (fit_scale && !from_0(fit_scale->shared_sd)) {
    refuse("fit_scale: shared_sd", fit_scale->shared_sd, "give a number from 0");
  }
  if (fit_scale && fit_scale->alone && !std::isfinite(fit_scale->alone->mean)) {
    refuse("fit_scale: alone: mean", fit_scale->alone->mean, "give a number");
  }
  if (fit_scale && fit_scale->alone && !is_positive(fit_scale->alone->sd)) {
    refuse("fit_scale: alone: sd", fit_scale->alone->sd, "give a positive number");
  }
  if (fit_scale && fit_scale->stranger_sd && !is_positive(*fit_scale->stranger_sd)) {
    refuse("fit_scale: stranger_sd", *fit_scale->stranger_sd, "give a positive number");
  }
  if (fit_scale && fit_scale->stranger_alone && !std::isfinite(fit_scale->stranger_alone->mean)) {
    refuse("fit_scale: stranger_alone: mean", fit_scale->stranger_alone->mean, "give a number");
  }
  if (fit_scale && fit_scale->stranger_alone && !(fit_scale->stranger_alone->sd >= 1.0)) {
    refuse("fit_scale: stranger_alone: sd", fit_scale->stranger_alone->sd,
           "give a number from 1, that of learned objects");
  }
  if (fit_scale && fit_scale->array &&
      !(is_positive(fit_scale->array->elements) && is_positive(fit_scale->array->spacing_mm))) {
    refuse("fit_scale: array", fit_scale->array->elements,
           "give a number of elements and a spacing_mm above 0");
  }
}

}  // namespace palpate
