#include "recognition/decision.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "estimation/lattice/refinement.hpp"
#include "model/body_spread.hpp"
#include "palpate/learned_sensor.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/scales.hpp"

namespace palpate {

namespace {

constexpr double least_probability = 1e-3;  ///< of a mode, and of an object to look for modes in
constexpr std::size_t most_modes = 5;
constexpr double held = 0.95;  ///< share of the belief that is to lie near the pose

/// [hypothesis] its share of its label's evidence.
std::vector<double> shares_of_label(const Estimate& estimate, const RecognitionTask& task) {
  const std::vector<double> of_label = label_log_evidence(estimate, task);
  std::vector<double> shares;
  for (std::size_t i = 0; i < estimate.log_evidence.size(); ++i) {
    const double all = of_label[task.label_of[i]];
    shares.push_back(all == log_zero ? 0.0 : std::exp(estimate.log_evidence[i] - all));
  }
  return shares;
}

/// Share of an object's belief at angles that are nearer to another of its n likenesses than to
/// its own, where all angles look alike (n = 0) at those more than 1/16 of a turn away.
/// @param shares [theta]
double share_at_other_turns(const Axis& theta, std::span<const double> shares, double own_rad,
                            int n) {
  const double own_half_rad = std::numbers::pi / (n == 0 ? 8 : n);
  double all = 0.0;
  double other = 0.0;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const double theta_rad = theta.centre(static_cast<int>(k));
    all += shares[k];
    if (std::abs(wrap_angle(theta_rad - own_rad, 2.0 * std::numbers::pi)) > own_half_rad) {
      other += shares[k];
    }
  }
  return all > 0.0 ? other / all : 0.0;
}

/// Whether the map looks the same after turns that it does not call equal.
bool may_look_alike(const OccupancyGrid& map) {
  return map.symmetry == 1 && map.suggested_symmetry.value_or(1) != 1;
}

/// The symmetry of an object's map, as far as its bins tell.
int symmetry_of(const OccupancyGrid& map, const PoseLattice& lattice,
                std::span<const BinShare> bins, double temperature) {
  if (bins.empty()) {
    return map.symmetry;
  }
  std::vector<double> shares(static_cast<std::size_t>(lattice.theta_rad.count));
  for (const BinShare& bin : bins) {
    shares[static_cast<std::size_t>(bin.bin / lattice.plane())] += bin.share;
  }
  const std::int64_t best = std::ranges::max_element(bins, {}, &BinShare::share)->bin;
  return symmetry_told(map, lattice.theta_rad, shares, lattice.T_object_robot(best).theta_rad,
                       temperature);
}

/// What is believed of one hypothesis's poses: shares of its label's belief.
struct PoseBelief {
  int object = 0;  ///< index of the hypothesis
  BinnedObject of;
  std::vector<BinShare> bins;
  FoundModes found;
};

/// Readings tell two poses apart as they tell two objects, and the temperature says how much too
/// sure of that they are. So the modes of a label weigh as labels do, by their shares to the power
/// of 1 / temperature. Together they keep the share that they had, and bins of no mode keep theirs.
void temper_modes(std::vector<PoseBelief>& beliefs, const RecognitionTask& task,
                  double temperature) {
  if (temperature == 1.0) {
    return;
  }
  std::vector<double> before(task.labels.size());
  std::vector<double> after(task.labels.size());
  for (const PoseBelief& belief : beliefs) {
    for (const BeliefMode& mode : belief.found.modes) {
      before[task.label_of[belief.object]] += mode.probability;
      after[task.label_of[belief.object]] += std::pow(mode.probability, 1.0 / temperature);
    }
  }
  for (PoseBelief& belief : beliefs) {
    const std::size_t label = task.label_of[belief.object];
    std::vector<double> factors;
    for (BeliefMode& mode : belief.found.modes) {
      const double root = std::pow(mode.probability, 1.0 / temperature);
      const double share = root > 0.0 ? before[label] * root / after[label] : 0.0;
      factors.push_back(root > 0.0 ? share / mode.probability : 1.0);
      mode.probability = share;
    }
    factors.push_back(1.0);  // of bins of no mode
    for (std::size_t i = 0; i < belief.bins.size(); ++i) {
      belief.bins[i].share *= factors[belief.found.mode_of[i]];
    }
  }
}

/// The beliefs of the hypotheses that may have a mode, and of the pose's.
/// @param share_of_label [hypothesis] see shares_of_label()
/// @param lattice receives that of the bins
std::vector<PoseBelief> pose_beliefs(const Recogniser& recogniser, const RecognitionTask& task,
                                     const RecognitionStep& step,
                                     std::span<const double> share_of_label, PoseLattice& lattice) {
  // Bins below it hold a thousandth of an object's belief, or of uncommonly many bins more: these
  // say little of peaks.
  const double least_share = std::max(1e-3 / static_cast<double>(task.lattice().bins()), 1e-7);
  std::vector<int> objects;
  for (std::size_t i = 0; i < share_of_label.size(); ++i) {
    const auto object = static_cast<int>(i);
    if (step.identity[task.label_of[i]] * share_of_label[i] >= least_probability ||
        object == step.mode.object) {
      objects.push_back(object);
    }
  }
  auto likely = recogniser.likely_bins(objects, least_share, lattice);
  const double temperature = task.temperature_after(recogniser.evidence());
  std::vector<PoseBelief> beliefs;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    const int object = objects[k];
    const OccupancyGrid& map = task.hypotheses[object].map;
    const int symmetry = object == step.mode.object
                             ? step.symmetry
                             : symmetry_of(map, lattice, likely[k], temperature);
    PoseBelief belief{object, {lattice, displaced_body(map), symmetry}, std::move(likely[k]), {}};
    belief.found = find_modes(belief.of, belief.bins);
    for (BeliefMode& mode : belief.found.modes) {
      mode.object = object;
      mode.probability *= share_of_label[object];
    }
    for (BinShare& bin : belief.bins) {
      bin.share *= share_of_label[object];
    }
    beliefs.push_back(std::move(belief));
  }
  temper_modes(beliefs, task, temperature);
  return beliefs;
}

/// The mode's mean and covariance, on the task's scale: those of the refined pose there where the
/// mode is narrow, as the bins are too wide to tell them.
/// @param refined the step's, on that scale, where the mode is that of its pose
ObjectPose between_bins(const Recogniser& recogniser, const RecognitionTask& task,
                        const BeliefMode& mode, const BinnedObject& of,
                        std::optional<RefinedPose> refined) {
  constexpr double narrow_mm = 1.0;
  const bool scaled = refined.has_value();
  if (spread_mm(of.body, mode.pose) >= narrow_mm) {
    return on_scale(task, recogniser.evidence(), of.body, mode.pose);
  }
  if (!scaled) {
    refined = recogniser.filter().refine({.object = mode.object, .T_object_robot = mode.best});
  }
  if (!refined) {
    return on_scale(task, recogniser.evidence(), of.body, mode.pose);
  }
  ObjectPose pose = inverse(least_turned(of.body, of.symmetry, *refined));
  pose.T_robot_object.theta_rad = wrap_angle(pose.T_robot_object.theta_rad, 2.0 * std::numbers::pi);
  return scaled ? pose : on_scale(task, recogniser.evidence(), of.body, pose);
}

/// BeliefPlaces::modes, whose poses are those of bins.
std::vector<BeliefMode> probable_modes(std::span<const PoseBelief> beliefs,
                                       const RecognitionTask& task, const RecognitionStep& step) {
  std::vector<BeliefMode> modes;
  for (const PoseBelief& belief : beliefs) {
    for (BeliefMode mode : belief.found.modes) {
      mode.probability *= step.identity[task.label_of[belief.object]];
      if (mode.probability >= least_probability) {
        modes.push_back(mode);
      }
    }
  }
  std::ranges::stable_sort(modes, std::greater<>(), &BeliefMode::probability);
  modes.resize(std::min(modes.size(), most_modes));
  return modes;
}

/// Sets share, within_mm and peak by the belief in the pose's object.
/// @param of_label probability of its label
void describe_neighbourhood(const PoseBelief& belief, const PoseLattice& lattice,
                            double share_of_label, double of_label, const RecognitionStep& step,
                            BeliefPlaces& places) {
  std::vector<PartAway> parts = parts_away(belief.of, belief.bins, step.pose());
  const double near = share_within(parts, neighbourhood_mm);
  places.share = std::min(of_label * near, of_label);  // shares round
  const auto bins_near = std::ranges::count_if(
      parts, [](const PartAway& part) { return part.mm <= neighbourhood_mm; });
  const double flat = static_cast<double>(bins_near) / static_cast<double>(lattice.bins());
  places.peak = near > std::min(0.5, std::numbers::e * flat) * share_of_label;
  if (step.refined) {
    parts = spread_between_bins(belief.of, std::move(parts), *step.refined);
  }
  const double proven = step.certificate ? 1.0 - step.certificate->dropped_mass : 1.0;
  // Above 1 where the label has less than all that is to lie near.
  const double share = held / (of_label * proven);
  places.within_mm = share <= 1.0 ? distance_holding(std::move(parts), share) : std::nullopt;
}

/// The mode that an estimate's mode is of; none where it is of none.
/// @param posed the belief in the estimate's object
std::optional<std::size_t> mode_at(std::span<const BeliefMode> modes, const PoseBelief& posed,
                                   const Mode& at) {
  std::optional<std::size_t> nearest;
  double nearest_mm = neighbourhood_mm;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (modes[i].object != at.object) {
      continue;
    }
    const double mm =
        pose_error_mm(posed.of.body, posed.of.symmetry, modes[i].best, at.T_object_robot);
    if (mm <= nearest_mm) {
      nearest_mm = mm;
      nearest = i;
    }
  }
  return nearest;
}

std::string percent(double probability) {
  // What is not quite certain is not called so.
  if (probability >= 0.999) {
    return "more than 99.9 %";
  }
  return fmt::format("{:.{}f} %", std::floor(1000.0 * probability) / 10.0,
                     probability >= 0.9 ? 1 : 0);
}

/// How near to where the robot says touches are taken to lie.
std::string about(const DisplacementSd& touch_sd) {
  return touch_sd.none() ? ""
                         : fmt::format("within some {:.2g} mm and {:.2g} degrees of ", touch_sd.mm,
                                       180.0 / std::numbers::pi * touch_sd.rad);
}

/// A probability that is not enough, of which percent() may tell too little.
std::string percent_below(double probability) {
  return probability < 0.999 ? percent(probability)
                             : fmt::format("{:.4f} %", std::floor(1e6 * probability) / 1e4);
}

}  // namespace

int symmetry_told(const OccupancyGrid& map, const Axis& theta, std::span<const double> shares,
                  double own_rad, double temperature) {
  constexpr double least_share = 0.05;
  if (!may_look_alike(map)) {
    return map.symmetry;
  }
  const double other = share_at_other_turns(theta, shares, own_rad, *map.suggested_symmetry);
  // Turns weigh as other poses do.
  const double odds = std::pow(other / (1.0 - other), 1.0 / temperature);
  return odds < least_share / (1.0 - least_share) ? map.symmetry : *map.suggested_symmetry;
}

int symmetry_told(const Recogniser& recogniser, const RecognitionTask& task,
                  const RecognitionStep& step) {
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  if (!may_look_alike(map)) {
    return map.symmetry;  // the marginals are not asked for
  }
  const Marginals marginals = recogniser.marginals(step.mode.object);
  return symmetry_told(map, marginals.grid.theta_rad, marginals.theta,
                       step.mode.T_object_robot.theta_rad,
                       task.temperature_after(recogniser.evidence()));
}

BeliefPlaces places_of(const Recogniser& recogniser, const Estimate& estimate,
                       const RecognitionTask& task, const RecognitionStep& step) {
  if (!recogniser.touched()) {
    return {.modes = {}, .peak = false};  // every bin is as likely: all would be looked at
  }
  const std::vector<double> share_of_label = shares_of_label(estimate, task);
  PoseLattice lattice;
  const std::vector<PoseBelief> beliefs =
      pose_beliefs(recogniser, task, step, share_of_label, lattice);
  const auto belief_in = [&](int object) -> const PoseBelief& {
    return *std::ranges::find(beliefs, object, &PoseBelief::object);
  };
  const PoseBelief& posed = belief_in(step.mode.object);
  BeliefPlaces places{.modes = probable_modes(beliefs, task, step)};
  describe_neighbourhood(posed, lattice, share_of_label[step.mode.object],
                         step.identity[task.label_of[step.mode.object]], step, places);
  places.own = mode_at(places.modes, posed, step.mode);
  for (std::size_t i = 0; i < places.modes.size(); ++i) {
    BeliefMode& mode = places.modes[i];
    mode.pose = between_bins(recogniser, task, mode, belief_in(mode.object).of,
                             i == places.own ? step.refined : std::nullopt);
  }
  return places;
}

Decision decide(const RecognitionStep& step, const RecognitionTask& task) {
  const std::string& best = task.labels[step.best];
  const std::string& posed = task.labels[task.label_of[step.mode.object]];
  const bool bounded = !step.identity_bounds.empty();
  const double proven = bounded ? step.identity_bounds[step.best].low : step.confidence();
  // Words say that they tell of a bound where that is well below the probability itself.
  constexpr double near = 0.05;
  const bool sure = step.confidence() - proven <= near;
  if (best == none_label) {
    return {false, fmt::format("{} has {}{}: the object was {} never learned", best,
                               percent(sure ? step.confidence() : proven),
                               sure ? "" : " for certain", proven > 0.5 ? "probably" : "possibly")};
  }
  if (step.fit && step.fit->verdict == Verdict::does_not_fit) {
    return {false, fmt::format("the touches do not fit {}, {:.0f} standard deviations worse than "
                               "its own do",
                               posed, -step.fit->z)};
  }
  if (!(proven >= task.act.above)) {
    // Where the probability itself is enough, they say so, too.
    const bool below = step.confidence() < task.act.above && sure;
    return {false, fmt::format("{} has {}{}, less than {:.10g} %", best, percent_below(proven),
                               below ? "" : " for certain", 100.0 * task.act.above)};
  }
  const BeliefPlaces& places = step.places;
  if (places.within_mm && *places.within_mm <= task.act.below_mm) {
    return {true,
            fmt::format("{} has {}, and 95 % of the belief lies within {:.2f} mm of its pose, "
                        "if the touches lie {}where the robot says",
                        best, percent(proven), *places.within_mm, about(task.touch_sd()))};
  }
  for (std::size_t i = 0; i < places.modes.size(); ++i) {
    const auto& [object, probability, at, pose] = places.modes[i];
    if (i != places.own && probability >= 1.0 - held) {
      const Pose& there = pose.T_robot_object;
      return {false,
              fmt::format(
                  "{:.0f} % of the belief lies elsewhere: {} at x {:.2f} mm, y {:.2f} mm, "
                  "theta {:.2f} deg",
                  100.0 * probability, task.name_of(object), there.translation_mm.x,
                  there.translation_mm.y,
                  180.0 / std::numbers::pi * wrap_angle(there.theta_rad, 2.0 * std::numbers::pi))};
    }
  }
  if (!places.within_mm) {
    return {false,
            fmt::format("less than 95 % of the belief is known to lie near the pose of {}", posed)};
  }
  // Rounded up, so that it is seen to be more.
  return {false,
          fmt::format("95 % of the belief lies within {:.2f} mm of the pose, not within {:g} mm",
                      std::ceil(100.0 * *places.within_mm) / 100.0, task.act.below_mm)};
}

}  // namespace palpate
