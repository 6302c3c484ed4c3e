#include <algorithm>
#include <array>
#include <optional>

#include <fmt/format.h>

#include "beliefs_parts.hpp"
#include "none_run.hpp"

namespace palpate::bench {

namespace {

constexpr double most_learned_called = 1.0;  ///< %
constexpr double least_pairs = 97.0;         ///< %, from 5 touches on

/// The least share of unlearned unknowns that must be called none, in percent; none where no goal
/// was set.
std::optional<Goal> goal_for_unlearned(int touches) {
  switch (touches) {
    case 3:
      return at_least(55.0);
    case 9:
      return at_least(88.0);
    case 15:
      return at_least(95.0);
    default:
      return {};
  }
}

/// Bins of equal width over [-extent, extent] along x and y, and the full circle.
PoseLattice lattice_over(double extent_mm, int count, int ntheta) {
  PoseLattice lattice = lattice_of(count, count, ntheta);
  lattice.x_mm = {-extent_mm, extent_mm, count};
  lattice.y_mm = lattice.x_mm;
  return lattice;
}

std::vector<NoneSetting> settings_of(const BeliefInputs& inputs) {
  const bool quick = inputs.options.quick;
  const int trials_each = inputs.trials_each(40, 4);
  std::vector<NoneSetting> settings = {
      {.name = "exact, ±10 mm", .lattice = lattice_over(10.0, 13, 55), .held_to_goals = true}};
  if (!quick) {
    settings.push_back(
        {.name = "exact, ±20 mm", .lattice = lattice_over(20.0, 26, 55), .held_to_goals = true});
    settings.push_back({.name = "exact, ±40 mm", .lattice = lattice_over(40.0, 52, 55)});
  }
  const DisplacementSd sd{1.0, 0.05};
  for (const auto& [name, touch_sd] : {std::pair("misplaced, averaged", sd),
                                       std::pair("misplaced, as if exact", DisplacementSd{})}) {
    settings.push_back({.name = name,
                        .lattice = quick ? lattice_of(13, 13, 55) : lattice_of(20, 20, 75),
                        .touching = {.at_random_poses = true, .pose_noise = {sd.mm, sd.rad}},
                        .touch_sd = touch_sd});
  }
  for (NoneSetting& setting : settings) {
    // As many bins as of +-40 mm take too long for all unknowns.
    setting.learned_each =
        std::max(setting.lattice.bins() > 100'000 ? trials_each / 4 : trials_each, 1);
    setting.unlearned_each = std::max(setting.learned_each / 2, 1);
  }
  return settings;
}

Case case_of(const NoneSetting& setting, const NoneRun& run) {
  const bool averaged = !setting.touch_sd.none();
  const bool from_5 = run.touches >= 5;
  const auto goal = [](bool holds, Goal value) {
    return holds ? std::optional(value) : std::nullopt;
  };
  const Interval pairs = run.told_apart_interval();
  return {.name = fmt::format("{}, touch {}", setting.name, run.touches),
          .facts = {{"learned", run.learned.log_odds.size()},
                    {"never learned", run.unlearned.log_odds.size()},
                    {"bins", size_of(setting.lattice)}},
          .measurements = {
              share_of("learned called none", run.learned.called_none, run.learned.log_odds.size(),
                       goal(run.touches > 1 && (setting.held_to_goals || averaged),
                            at_most(most_learned_called))),
              share_of("never learned called none", run.unlearned.called_none,
                       run.unlearned.log_odds.size(),
                       setting.held_to_goals ? goal_for_unlearned(run.touches) : std::nullopt),
              {.name = "never learned told from learned",
               .value = 100.0 * run.told_apart(),
               .unit = "% of pairs",
               .goal = goal(from_5 && (setting.held_to_goals || averaged), at_least(least_pairs)),
               .interval = Interval{100.0 * pairs.low, 100.0 * pairs.high}}}};
}

Json record_of(const NoneSetting& setting, const NoneRun& run) {
  return {{"name", setting.name},
          {"touches", run.touches},
          {"learned_called_none", run.learned.share_called_none()},
          {"unlearned_called_none", run.unlearned.share_called_none()},
          {"told_apart", run.told_apart()},
          {"learned_log_odds", run.learned.log_odds},
          {"unlearned_log_odds", run.unlearned.log_odds}};
}

}  // namespace

Json measure_none(const BeliefInputs& inputs, Report& report) {
  constexpr std::array touches = {1, 3, 5, 9, 15};
  Json records = Json::array();
  for (const NoneSetting& setting : settings_of(inputs)) {
    for (const NoneRun& run : run_none(inputs.device, inputs.letters, setting, touches)) {
      report.add(case_of(setting, run));
      records.push_back(record_of(setting, run));
    }
  }
  return records;
}

}  // namespace palpate::bench
