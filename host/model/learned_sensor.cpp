#include "palpate/learned_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

namespace {

/// Throws Error, "sensor model: <field> = <value>: <remedy>", unless the value fits.
template <typename Value>
void check(bool fits, std::string_view field, const Value& value, std::string_view remedy) {
  if (!fits) {
    throw Error(Fault::input, fmt::format("sensor model: {} = {}: {}", field, value, remedy));
  }
}

bool is_positive(double x) { return x > 0.0 && std::isfinite(x); }
bool from_0(double x) { return x >= 0.0 && std::isfinite(x); }

void require_finite(std::string_view field, double x) {
  check(std::isfinite(x), field, x, "give a number");
}
void require_positive(std::string_view field, double x) {
  check(is_positive(x), field, x, "give a positive number");
}
void require_from_0(std::string_view field, double x) {
  check(from_0(x), field, x, "give a number from 0");
}

/// The matrix of correlations; none where it is not positive definite.
std::optional<glm::dmat3> correlations_of(const FeatureDistribution& distribution) {
  const auto [area_force, area_peak, force_peak] = distribution.correlation;
  const glm::dmat3 all(1.0, area_force, area_peak,   //
                       area_force, 1.0, force_peak,  //
                       area_peak, force_peak, 1.0);
  const bool definite = 1.0 - area_force * area_force > 0.0 && glm::determinant(all) > 0.0;
  return definite ? std::optional(all) : std::nullopt;
}

/// @param numbers [level, node] of a learned table
void require_sound(const LearnedTable& table, const std::vector<double>& numbers) {
  table_of(table, numbers).validate();
  const auto wrong = std::ranges::find_if_not(numbers, [](double log) { return log <= 0.0; });
  if (wrong != numbers.end()) {
    const std::ptrdiff_t i = wrong - numbers.begin();
    check(false,
          fmt::format("table: number [{}, {}]", i / ReadingLayer::nodes, i % ReadingLayer::nodes),
          *wrong, "give the log of a probability, 0 or less");
  }
}

void require_sound(const FeatureDistribution& distribution) {
  for (std::size_t i = 0; i < PressFeatures::count; ++i) {
    require_finite("features: mean", distribution.mean[i]);
    require_positive("features: sd", distribution.sd[i]);
  }
  check(correlations_of(distribution).has_value(), "features: correlation",
        fmt::format("[{}]", fmt::join(distribution.correlation, ", ")),
        "give correlations that a distribution can have");
}

void require_sound(const FitScale& scale) {
  require_finite("fit_scale: mean", scale.mean);
  require_positive("fit_scale: sd", scale.sd);
  require_from_0("fit_scale: shared_sd", scale.shared_sd);
  if (const auto& single_touch = scale.single_touch) {
    require_finite("fit_scale: alone: mean", single_touch->mean);
    require_positive("fit_scale: alone: sd", single_touch->sd);
  }
  if (scale.stranger_sd) {
    require_positive("fit_scale: stranger_sd", *scale.stranger_sd);
  }
  if (const auto& stranger = scale.stranger_single_touch) {
    require_finite("fit_scale: stranger_alone: mean", stranger->mean);
    check(stranger->sd >= 1.0, "fit_scale: stranger_alone: sd", stranger->sd,
          "give a number from 1, that of learned objects");
  }
  if (const auto& array = scale.array) {
    check(is_positive(array->elements) && is_positive(array->spacing_mm), "fit_scale: array",
          array->elements, "give a number of elements and a spacing_mm above 0");
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
  check(pressure_unit == "kPa" || pressure_unit == "raw", "pressure_unit", pressure_unit,
        "give kPa or raw");
  classifier.validate();
  require_from_0("noise", noise);
  check(gamma >= 0.0 && gamma < 1.0, "gamma", gamma, "give a number in [0, 1)");
  check(prior >= least_prior && prior <= 1.0 - least_prior, "prior", prior,
        "give a probability from 1e-6 to 1 - 1e-6");
  check(spread_mm >= least_length_mm && spread_mm <= most_length_mm, "spread_mm", spread_mm,
        "give a length from 1e-6 to 1e6");
  for (const double sd : {touch_sd.mm, touch_sd.rad}) {
    check(from_0(sd), "touch_sd", sd, "give numbers from 0");
  }
  require_positive("temperature", temperature);
  require_from_0("temperature_growth", temperature_growth);
  if (bins) {
    for (const double step : {bins->x_mm, bins->y_mm, bins->theta_rad}) {
      check(from_0(step), "bins", step, "give steps from 0");
    }
  }
  if (table) {
    table->layer.validate();
    require_sound(*table, table->shared);
    for (const auto& [label, own] : table->objects) {
      check(own.size() == table->shared.size(), "table: numbers", own.size(),
            "give as many to every object as to all together");
      require_sound(*table, own);
    }
  }
  if (features) {
    require_from_0("features: weight", features->weight);
    require_sound(features->any);
    for (const auto& [label, own] : features->objects) {
      require_sound(own);
    }
  }
  if (fit_scale) {
    require_sound(*fit_scale);
  }
  if (pose_scale) {
    require_positive("pose_scale: factor", pose_scale->factor);
    require_from_0("pose_scale: map_sd_mm", pose_scale->map_sd_mm);
  }
}

}  // namespace palpate
