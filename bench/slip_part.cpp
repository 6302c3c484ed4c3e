#include <numbers>
#include <tuple>

#include "beliefs_parts.hpp"
#include "slip_run.hpp"

namespace palpate::bench {

namespace {

constexpr double most_error_mm = 1.0;  ///< of the mode that follows, mean over touches

/// Bins over x and y in [-8, 8] mm and the full circle. Steps of 0.5 mm and 2 degrees resolve slips
/// of 0.3 mm and 1 degree.
PoseLattice lattice_near(int count, int ntheta) {
  PoseLattice lattice = lattice_of(count, count, ntheta);
  lattice.x_mm = {-8.0, 8.0, count};
  lattice.y_mm = lattice.x_mm;
  return lattice;
}

Measurement mean_error(const std::string& name, const std::vector<PoseErrors>& errors,
                       std::size_t from, std::optional<Goal> goal) {
  const std::vector<double> means_mm = present(mean_mode_errors(errors, from));
  Measurement result{.name = name, .value = mean(means_mm), .unit = "mm", .goal = goal};
  if (means_mm.size() > 2) {
    result.interval = mean_interval(means_mm);
  }
  return result;
}

Json curve_of(const std::vector<PoseErrors>& errors) {
  Json curve = Json::array();
  for (const PoseErrors& touch : errors) {
    const std::vector<double> located_mm = present(touch.mode_mm);
    curve.push_back({{"touches", curve.size() + 1},
                     {"located", located_mm.size()},
                     {"mode_mm", located_mm.empty() ? Json(nullptr) : Json(mean(located_mm))}});
  }
  return curve;
}

}  // namespace

Json measure_slip(const BeliefInputs& inputs, Report& report) {
  const bool quick = inputs.options.quick;
  const SlipSetting setting{.step = {0.3, std::numbers::pi / 180.0},
                            .lattice = quick ? lattice_near(20, 75) : lattice_near(32, 180),
                            .trials_each = inputs.trials_each(5, 1),
                            .touches = quick ? 12 : 50};
  const SlipRun run = run_slip(inputs.device, inputs.letters, setting);
  Case result{.name = "slip 0.3 mm, 1 degree",
              .facts = {{"unknowns", run.followed.front().mode_mm.size()},
                        {"touches", setting.touches},
                        {"bins", size_of(setting.lattice)}}};
  Json records = Json::array();
  for (const auto& [belief, errors, goal] :
       {std::tuple("with slip_sd", &run.followed, std::optional(at_most(most_error_mm))),
        std::tuple("without", &run.at_rest, std::optional<Goal>())}) {
    const std::string name = belief;
    result.measurements.push_back(
        mean_error(name + ": mode's error, mean over touches", *errors, 0, goal));
    result.measurements.push_back(mean_error(name + ": mode's error, second half of the touches",
                                             *errors, errors->size() / 2, {}));
    result.measurements.push_back(
        {name + ": touches at which the mode has the right letter", 100.0 * located(*errors), "%"});
    records.push_back({{"belief", belief}, {"curve", curve_of(*errors)}});
  }
  report.add(result);
  return records;
}

}  // namespace palpate::bench
