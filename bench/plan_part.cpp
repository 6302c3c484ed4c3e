#include <algorithm>
#include <array>
#include <span>

#include <fmt/format.h>

#include "beliefs_parts.hpp"
#include "bootstrap.hpp"
#include "letters.hpp"
#include "plan_run.hpp"

namespace palpate::bench {

namespace {

using Values = std::vector<double> PlanTrial::*;

/// [unknown] What a field says after some number of touches.
std::vector<double> after(const std::vector<PlanTrial>& trials, Values field, int touches) {
  std::vector<double> values;
  for (const PlanTrial& trial : trials) {
    values.push_back((trial.*field).at(static_cast<std::size_t>(touches) - 1));
  }
  return values;
}

Json record_of_mean(std::span<const double> values) {
  const Interval interval = bootstrap_mean_interval(values);
  return {{"mean", mean(values)}, {"low", interval.low}, {"high", interval.high}};
}

Json record_of(const char* order, const std::vector<PlanTrial>& trials, Values entropy,
               Values log_loss, int touches) {
  Json curve = Json::array();
  for (int touch = 1; touch <= touches; ++touch) {
    curve.push_back({{"touches", touch},
                     {"entropy", record_of_mean(after(trials, entropy, touch))},
                     {"log_loss", record_of_mean(after(trials, log_loss, touch))}});
  }
  return {{"order", order}, {"curve", std::move(curve)}};
}

Measurement mean_of(const std::string& name, std::span<const double> values,
                    std::optional<Goal> goal = {}) {
  return {.name = name,
          .value = mean(values),
          .unit = "nats",
          .goal = goal,
          .interval = bootstrap_mean_interval(values)};
}

}  // namespace

Json measure_plan(const BeliefInputs& inputs, Report& report) {
  const bool quick = inputs.options.quick;
  const PlanSetting setting{.lattice = lattice_of(13, 13, 55),
                            .trials_each = inputs.trials_each(20, 1),
                            .touches = quick ? 4 : 7};
  constexpr double most_nats_above = 0.1;
  const std::vector<PlanTrial> trials = run_plan(inputs.device, inputs.letters, setting);
  Case result{.name = "planned touches",
              .facts = {{"unknowns", trials.size()}, {"bins", size_of(setting.lattice)}}};
  for (int touch = 1; touch <= setting.touches; ++touch) {
    for (const auto& [order, entropy] : {std::pair("random", &PlanTrial::random_nats),
                                         std::pair("planned", &PlanTrial::planned_nats)}) {
      result.measurements.push_back(mean_of(fmt::format("entropy, {}, touch {}", order, touch),
                                            after(trials, entropy, touch)));
    }
  }
  for (const auto& [planned, random] : {std::pair(3, 4), std::pair(4, 6), std::pair(5, 7)}) {
    if (random <= setting.touches) {
      std::vector<double> above = after(trials, &PlanTrial::planned_nats, planned);
      const std::vector<double> random_nats = after(trials, &PlanTrial::random_nats, random);
      for (std::size_t i = 0; i < above.size(); ++i) {
        above[i] -= random_nats[i];
      }
      result.measurements.push_back(
          mean_of(fmt::format("{} planned above {} random", planned, random), above,
                  at_most(most_nats_above)));
    }
  }
  std::vector<double> milliseconds;
  for (const PlanTrial& trial : trials) {
    for (const double seconds : trial.plan_seconds) {
      milliseconds.push_back(1e3 * seconds);
    }
  }
  result.measurements.push_back({"plan, median", median(milliseconds), "ms"});
  report.add(result);
  return {record_of("random", trials, &PlanTrial::random_nats, &PlanTrial::random_log_loss,
                    setting.touches),
          record_of("planned", trials, &PlanTrial::planned_nats, &PlanTrial::planned_log_loss,
                    setting.touches)};
}

}  // namespace palpate::bench
