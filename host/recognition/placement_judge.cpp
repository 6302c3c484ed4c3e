#include "recognition/placement_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "estimation/hypotheses.hpp"
#include "model/displacement_points.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/placed_touches.hpp"

namespace palpate {

namespace {

constexpr double usual_rad_per_mm = 0.05;     // a robot that is 1 mm off is some 3 degrees off
constexpr std::size_t fewest_in_contact = 2;  // before and after a move: one touch fits anywhere

constexpr std::size_t points_told = 32;  // for the touch-sd that the task has
/// Volume of the moves that count as equally likely where an object moves a little, mm^2 rad.
constexpr double near_places = 30.0 * 30.0 * 0.8;
/// Tempered log odds from which another explanation is taken before that of the step: objects
/// seldom move, and the size of displacements is chosen to suit the touches.
constexpr double least_displaced_nats = 4.0;
constexpr double least_move_nats = 4.0;
/// The same before "(none)": two pieces of a learned object explain a few touches of a stranger.
constexpr double least_move_over_none_nats = 8.0;

/// A way to explain the touches.
struct Explanation {
  TouchPlacement placement;
  double log_evidence = log_zero;  ///< as Estimate::log_evidence
  Fit fit = {};                    ///< on the task's scale
};

/// What all explanations of one unknown share.
struct Question {
  const Recogniser& recogniser;
  const RecognitionTask& task;
  double offset = 0.0;  ///< of log evidence without a weight from a log-likelihood over bins
  std::vector<double> log_weight = {};  ///< [hypothesis]
  std::size_t in_contact = 0;           ///< touches

  std::span<const TouchEvidence> touches() const { return recogniser.evidence(); }
  TouchRange all() const { return {0, touches().size()}; }
  double log_bin() const {
    const PoseLattice& lattice = recogniser.lattice();
    double log_volume = 0.0;
    for (const Axis* axis : {&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad}) {
      log_volume += axis->step() > 0.0 ? std::log(axis->step()) : 0.0;
    }
    return log_volume;
  }
  /// The log evidence of a hypothesis that has a peak, on the scale of Estimate::log_evidence.
  double log_evidence(int object, double nats, double log_volume) const {
    return nats + log_volume - log_bin() + offset + log_weight[object];
  }
  Fit fit(std::span<const TouchEvidence> placed, const Pose& T_object_robot, DisplacementSd sd,
          int object) const {
    const OccupancyGrid& map = task.hypotheses[object].compared();
    return task.fit_scale().of(
        evidence_fit(placed, T_object_robot, map, task.contact(), sd, object).value(), in_contact);
  }
};

/// The touches each lie somewhere else.
Explanation displaced(const Question& question, const PlacedTouches& touches, int object,
                      const Pose& from) {
  constexpr std::size_t points = 64;
  constexpr double least_mm = 0.2;
  constexpr double most_mm = 2.0;
  const DisplacementSd told = question.task.touch_sd();
  const double rad_per_mm = told.mm > 0.0 && told.rad > 0.0 ? told.rad / told.mm : usual_rad_per_mm;
  const TouchRange all = question.all();
  // Each round learns the standard deviation anew (expectation maximisation).
  double sd_mm = std::max(1.0, told.mm);
  PlacedPeak peak{from, 0.0};
  for (const double first_mm : {1.0, 0.5}) {
    const auto at = displacement_points({sd_mm, rad_per_mm * sd_mm}, points / 2);
    peak = touches.climb(peak.T_object_robot, at, all, first_mm);
    const double next_mm = touches.displaced_mm(peak.T_object_robot, at, all);
    // Twice its step, which is short.
    sd_mm = std::clamp(next_mm * next_mm / sd_mm, least_mm, most_mm);
  }
  const DisplacementSd sd{sd_mm, rad_per_mm * sd_mm};
  const auto at = displacement_points(sd, points);
  peak = touches.climb(peak.T_object_robot, at, all, 0.25);
  return {
      .placement = {.object = object, .displaced = sd},
      .log_evidence = question.log_evidence(object, peak.nats, touches.log_volume(peak, at, all)),
      .fit = question.fit(question.touches(), peak.T_object_robot, sd, object)};
}

/// The best peaks of the touches before and from each touch on.
struct Parts {
  std::vector<PlacedPeak> before;  ///< [touch] of those before it
  std::vector<PlacedPeak> from;    ///< [touch] of it and those after it
};

/// Looks at places in the whole region, coarsely; none where there are too many. Touches are added
/// one by one from either end as long as a place is not far worse than the best for as many.
std::optional<Parts> coarse_parts(const PlacedTouches& touches, const PoseLattice& region) {
  const std::vector<Pose> at(1);
  constexpr double step_mm = 1.25;
  constexpr double step_rad = 0.125;
  constexpr std::int64_t most_places = 400'000;
  constexpr double hopeless = 30.0;  // nats; more than the coarse steps cost
  const auto coarse = [](Axis axis, double step) {
    axis.count = std::max(static_cast<int>(std::ceil((axis.upper - axis.lower) / step)), 1);
    return axis;
  };
  const PoseLattice places{coarse(region.x_mm, step_mm), coarse(region.y_mm, step_mm),
                           coarse(region.theta_rad, step_rad), region.pivot_mm};
  if (places.bins() > most_places) {
    return {};
  }
  const std::size_t n = touches.size();
  const PlacedPeak none{{}, log_zero};
  Parts best{std::vector<PlacedPeak>(n + 1, none), std::vector<PlacedPeak>(n + 1, none)};
  for (std::int64_t place = 0; place < places.bins(); ++place) {
    const Pose to = places.T_object_robot(place);
    const auto add_up = [&](std::vector<PlacedPeak>& parts, bool backwards) {
      double nats = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        const std::size_t touch = backwards ? n - 1 - i : i;
        nats += touches.log_likelihood(to, at, {touch, touch + 1});
        PlacedPeak& part = parts[backwards ? touch : touch + 1];
        if (nats > part.nats) {
          part = {to, nats};
        } else if (nats < part.nats - hopeless) {
          break;
        }
      }
    };
    add_up(best.before, false);
    add_up(best.from, true);
  }
  return best;
}

/// Of the places that suit the first touches or the last, the one that suits all where each may lie
/// a millimetre beside its place.
Pose best_start(const PlacedTouches& touches, const Parts& parts, TouchRange all) {
  const auto at = displacement_points({1.0, usual_rad_per_mm}, 32);
  PlacedPeak best{{}, log_zero};
  for (const std::vector<PlacedPeak>* of : {&parts.before, &parts.from}) {
    for (const PlacedPeak& part : *of) {
      const double nats =
          part.nats == log_zero ? log_zero : touches.log_likelihood(part.T_object_robot, at, all);
      if (nats > best.nats) {
        best = {part.T_object_robot, nats};
      }
    }
  }
  return best.T_object_robot;
}

/// The object moved once.
/// @param starts where its parts are climbed from
/// @param log_places of the volume of the places that it may have moved to, mm^2 rad
std::optional<Explanation> moved(const Question& question, const PlacedTouches& touches, int object,
                                 const Parts& starts, double log_places) {
  if (question.in_contact < 2 * fewest_in_contact) {
    return {};
  }
  const std::size_t n = touches.size();
  const DisplacementSd told = question.task.touch_sd();
  const auto at = displacement_points(told, points_told);
  double most = log_zero;
  std::size_t after = 0;
  std::array<PlacedPeak, 2> parts;
  std::size_t in_contact = 0;
  for (std::size_t k = 1; k < n; ++k) {
    in_contact += question.touches()[k - 1].in_contact() ? 1 : 0;
    if (in_contact < fewest_in_contact || question.in_contact - in_contact < fewest_in_contact) {
      continue;
    }
    const PlacedPeak a = touches.climb(starts.before[k].T_object_robot, at, {0, k}, 1.0);
    const PlacedPeak b = touches.climb(starts.from[k].T_object_robot, at, {k, n}, 1.0);
    if (a.nats + b.nats > most) {
      most = a.nats + b.nats;
      after = k;
      parts = {a, b};
    }
  }
  if (after == 0) {
    return {};
  }
  std::vector<TouchEvidence> kept(question.touches().begin(), question.touches().end());
  const Pose move = inverse(parts[0].T_object_robot) * parts[1].T_object_robot;
  for (std::size_t i = after; i < n; ++i) {
    kept[i].T_robot_sensor = move * kept[i].T_robot_sensor;
  }
  const double volumes =
      touches.log_volume(parts[0], at, {0, after}) + touches.log_volume(parts[1], at, {after, n});
  const Hypothesis& hypothesis = question.task.hypotheses[object];
  const std::optional<Body>& body = question.task.bodies[object];
  return Explanation{.placement = {.object = object,
                                   .moved_after = after,
                                   .moved_mm = body ? pose_error_mm(*body, hypothesis.map.symmetry,
                                                                    parts[0].T_object_robot,
                                                                    parts[1].T_object_robot)
                                                    : 0.0},
                     .log_evidence = question.log_evidence(object, most, volumes - log_places) -
                                     std::log(static_cast<double>(n - 1)),
                     .fit = question.fit(kept, parts[0].T_object_robot, told, object)};
}

/// The log evidence of a hypothesis by its peak near a pose, where touches lie as the task has it:
/// what bins say of a peak that is narrower than they are cannot be compared with this.
double log_evidence_here(const Question& question, const std::pair<int, Pose>& at_pose) {
  const auto& [object, from] = at_pose;
  const RecognitionTask& task = question.task;
  const PlacedTouches placed(question.touches(), task, static_cast<std::size_t>(object),
                             question.recogniser.lattice());
  const auto at = displacement_points(task.touch_sd(), points_told);
  const PlacedPeak peak = placed.climb(from, at, question.all(), 0.5);
  return question.log_evidence(object, peak.nats, placed.log_volume(peak, at, question.all()));
}

/// The most probable hypotheses and where each explains the touches best.
std::vector<std::pair<int, Pose>> candidates(const Recogniser& recogniser, const Estimate& estimate,
                                             const RecognitionStep& step, double& share) {
  constexpr std::size_t most = 5;
  std::vector<int> objects(estimate.log_evidence.size());
  std::iota(objects.begin(), objects.end(), 0);
  std::ranges::stable_sort(objects, std::greater<>(),
                           [&](int object) { return estimate.log_evidence[object]; });
  const auto own = std::ranges::find(objects, step.mode.object);
  std::rotate(objects.begin(), own, own + 1);
  objects.resize(std::min(objects.size(), most));
  PoseLattice lattice;
  const auto likely = recogniser.likely_bins(objects, 1e-3, lattice);
  std::vector<std::pair<int, Pose>> found;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (likely[i].empty()) {
      continue;
    }
    const BinShare best = *std::ranges::max_element(likely[i], {}, &BinShare::share);
    share = i == 0 ? best.share : share;
    found.emplace_back(objects[i], i == 0 ? step.pose() : lattice.T_object_robot(best.bin));
  }
  return found;
}

}  // namespace

std::optional<TouchPlacement> judge_placement(const Recogniser& recogniser,
                                              const Estimate& estimate, const RecognitionTask& task,
                                              const RecognitionStep& step) {
  const std::span<const TouchEvidence> touches = recogniser.evidence();
  Question question{.recogniser = recogniser, .task = task};
  question.in_contact =
      static_cast<std::size_t>(std::ranges::count_if(touches, &TouchEvidence::in_contact));
  const bool none = task.labels[step.best] == none_label;
  const bool unexplained = none || (step.fit && step.fit->verdict == Verdict::does_not_fit);
  const bool doubtful = step.decision.act || (step.fit && step.fit->verdict == Verdict::doubtful);
  if (!step.refined || !task.slip_sd().none() || question.in_contact < fewest_in_contact ||
      !(unexplained || doubtful)) {
    return {};
  }
  double share = 1.0;
  auto objects = candidates(recogniser, estimate, step, share);
  if (objects.empty() || objects.front().first != step.mode.object) {
    return {};
  }
  const int own = step.mode.object;
  question.log_weight = log_weights(task.hypotheses);
  question.offset = estimate.log_evidence[own] - question.log_weight[own] -
                    (step.mode.log_likelihood - std::log(share));
  if (!unexplained) {
    objects.resize(1);
  }
  const double temperature = task.temperature_after(touches);
  const double exact = log_evidence_here(question, objects.front());
  const auto explains = [&](const Explanation& one) {
    if (one.fit.verdict == Verdict::does_not_fit) {
      return false;
    }
    const double least = one.placement.moved_after > 0 ? least_move_nats : least_displaced_nats;
    if (!none) {
      return (one.log_evidence - exact) / temperature > least;
    }
    const Tempering tempering = tempering_of(touches, task, one.fit);
    const std::size_t label = task.label_of[one.placement.object];
    const double lead =
        tempering.tempered(one.log_evidence, label) -
        tempering.tempered(estimate.none_log_evidence.value_or(log_zero), step.best);
    return lead > (one.placement.moved_after > 0 ? least_move_over_none_nats : 0.0);
  };
  std::optional<Explanation> found;
  const auto consider = [&](const std::optional<Explanation>& one) {
    if (one && explains(*one) && (!found || one->log_evidence > found->log_evidence)) {
      found = one;
    }
  };
  const auto placed_on = [&](int object) {
    return PlacedTouches(touches, task, static_cast<std::size_t>(object), recogniser.lattice());
  };
  for (const auto& [object, from] : objects) {
    const PlacedTouches placed = placed_on(object);
    const std::vector<PlacedPeak> here(touches.size() + 1, {from, 0.0});
    consider(displaced(question, placed, object, from));
    consider(moved(question, placed, object, {here, here}, std::log(near_places)));
  }
  // Displacements would make a search through the region long.
  if (!found && unexplained && task.touch_sd().none()) {
    const PoseLattice& region = recogniser.lattice();
    const double log_places = std::log(static_cast<double>(region.bins())) + question.log_bin();
    for (const auto& [object, from] : objects) {
      const PlacedTouches placed = placed_on(object);
      if (const auto parts = coarse_parts(placed, region)) {
        consider(displaced(question, placed, object, best_start(placed, *parts, question.all())));
        consider(moved(question, placed, object, *parts, log_places));
      }
    }
  }
  return found ? std::optional(found->placement) : std::nullopt;
}

std::string placement_words(const TouchPlacement& placement, const RecognitionTask& task) {
  const std::string name = task.name_of(placement.object);
  return placement.moved_after > 0
             ? fmt::format(
                   "the object, {} by the touches, seems to have moved by {:.1f} mm after "
                   "touch {}",
                   name, placement.moved_mm, placement.moved_after)
             : fmt::format(
                   "the touches fit {} where each lies some {:.1f} mm beside the place that "
                   "the robot says",
                   name, placement.displaced.mm);
}

std::string placement_warning(const TouchPlacement& placement, const RecognitionTask& task) {
  const std::string words = placement_words(placement, task);
  return placement.moved_after > 0
             ? words + ": hold it still, or recognise the touches before and after by themselves"
             : words + fmt::format(
                           ": is touch-sd too small? give `touch-sd-mm {:.1f}` "
                           "`touch-sd-deg {:.1f}`",
                           placement.displaced.mm,
                           180.0 / std::numbers::pi * placement.displaced.rad);
}

}  // namespace palpate
