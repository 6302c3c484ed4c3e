#include "recognition/decision.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "estimation/hypotheses.hpp"
#include "model/displacement_points.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/belief_cells.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/placed_touches.hpp"

namespace palpate {

namespace {

constexpr double usual_rad_per_mm = 0.05;     // a robot that is 1 mm off is some 3 degrees off
constexpr std::size_t fewest_in_contact = 2;  // before and after a move: one touch fits anywhere

constexpr std::size_t touch_sd_points = 32;  // for the touch-sd that the task has
/// Volume of the moves that count as equally likely where an object moves a little, mm^2 rad.
constexpr double near_places = 30.0 * 30.0 * 0.8;
/// Tempered log odds from which another explanation is taken before that of the step: objects
/// seldom move, and the size of displacements is chosen to suit the touches.
constexpr double least_nats = 4.0;
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
  std::vector<TouchEvidence> touches = {};  ///< those that tell anything: others change no finding
  std::vector<std::size_t> number = {};     ///< [touch] from 1, among all of the unknown
  double offset = 0.0;  ///< of log evidence without a weight from a log-likelihood over bins
  std::vector<double> log_weight = {};  ///< [hypothesis]
  std::size_t in_contact = 0;           ///< touches

  double log_bin() const {
    double log_volume = 0.0;
    for (const Axis* axis : axes_of(recogniser.lattice())) {
      log_volume += axis->step() > 0.0 ? std::log(axis->step()) : 0.0;
    }
    return log_volume;
  }
};

/// The best peaks of the touches before and from each touch on.
struct Parts {
  std::vector<PlacedPeak> before;  ///< [touch] of those before it
  std::vector<PlacedPeak> from;    ///< [touch] of it and those after it
};

/// One hypothesis, and how it explains an unknown's touches.
class Explainer {
 public:
  Explainer(const Question& question, int object)
      : question_(question),
        object_(object),
        touches_(question.touches),
        placed_(touches_, question.task, static_cast<std::size_t>(object),
                question.recogniser.lattice()) {}

  /// The peak where touches lie as the task has it.
  PlacedPeak unmoved(const Pose& from) const { return placed_.climb(from, told_, all_, 0.5); }
  /// By that peak: what bins say of a peak narrower than they are cannot be compared with it.
  double log_evidence(const PlacedPeak& unmoved) const {
    return log_evidence(unmoved.nats, placed_.log_volume(unmoved, told_, all_));
  }
  /// Whether touches are likelier beside their places, by more than the task has it, at that peak:
  /// climbing from there gains less than an explanation has to.
  bool may_be_displaced(const PlacedPeak& unmoved) const {
    return std::ranges::any_of(std::array{0.2, 0.4, 0.8, 1.6}, [&](double mm) {
      const auto at = displacement_points(displacement_of(mm), touch_sd_points);
      return mm > question_.task.touch_sd().mm &&
             placed_.log_likelihood(unmoved.T_object_robot, at, all_) > unmoved.nats;
    });
  }
  /// The touches each lie somewhere else; none where no farther than the task has it.
  std::optional<Explanation> displaced(const Pose& from) const {
    constexpr std::size_t points = 64;
    constexpr double least_mm = 0.2;
    constexpr double most_mm = 2.0;
    const double told_mm = question_.task.touch_sd().mm;
    // Each round learns the standard deviation anew (expectation maximisation).
    double sd_mm = std::max(1.0, told_mm);
    PlacedPeak peak{from, 0.0};
    for (const double first_mm : {1.0, 0.5}) {
      const auto at = displacement_points(displacement_of(sd_mm), points / 2);
      peak = placed_.climb(peak.T_object_robot, at, all_, first_mm);
      const double next_mm = placed_.displaced_mm(peak.T_object_robot, at, all_);
      // Twice its step, which is short.
      sd_mm = std::clamp(next_mm * next_mm / sd_mm, least_mm, most_mm);
    }
    if (sd_mm <= told_mm) {
      return {};
    }
    const DisplacementSd sd = displacement_of(sd_mm);
    const auto at = displacement_points(sd, points);
    peak = placed_.climb(peak.T_object_robot, at, all_, 0.25);
    return Explanation{.placement = {.object = object_, .displaced = sd},
                       .log_evidence = log_evidence(peak.nats, placed_.log_volume(peak, at, all_)),
                       .fit = fit(touches_, peak.T_object_robot, sd)};
  }
  /// The object moved once.
  /// @param starts where its parts are climbed from
  /// @param log_places of the volume of the places that it may have moved to, mm^2 rad
  std::optional<Explanation> moved(const Parts& starts, double log_places) const {
    if (question_.in_contact < 2 * fewest_in_contact) {
      return {};
    }
    const std::size_t n = touches_.size();
    const RecognitionTask& task = question_.task;
    KnownNats known;
    double largest = log_zero;
    std::size_t after = 0;
    std::array<PlacedPeak, 2> parts;
    for (std::size_t k = 1; k < n; ++k) {
      const std::size_t in_contact = touches_in_contact(touches_.first(k));
      if (in_contact < fewest_in_contact || question_.in_contact - in_contact < fewest_in_contact) {
        continue;
      }
      const PlacedPeak a =
          placed_.climb(starts.before[k].T_object_robot, told_, {0, k}, 1.0, &known);
      const PlacedPeak b = placed_.climb(starts.from[k].T_object_robot, told_, {k, n}, 1.0, &known);
      if (a.nats + b.nats > largest) {
        largest = a.nats + b.nats;
        after = k;
        parts = {a, b};
      }
    }
    if (after == 0) {
      return {};
    }
    const auto& [before, from] = parts;
    std::vector<TouchEvidence> kept(touches_.begin(), touches_.end());
    const Pose move = inverse(before.T_object_robot) * from.T_object_robot;
    for (std::size_t i = after; i < n; ++i) {
      kept[i].T_robot_sensor = move * kept[i].T_robot_sensor;
    }
    const double volumes =
        placed_.log_volume(before, told_, {0, after}) + placed_.log_volume(from, told_, {after, n});
    const std::optional<Body>& body = task.bodies[object_];
    const double moved_mm = body ? pose_error_mm(*body, task.hypotheses[object_].map.symmetry,
                                                 before.T_object_robot, from.T_object_robot)
                                 : 0.0;
    return Explanation{.placement = {.object = object_,
                                     .moved_after = question_.number[after - 1],
                                     .moved_mm = moved_mm},
                       .log_evidence = log_evidence(largest, volumes - log_places) -
                                       std::log(static_cast<double>(n - 1)),
                       .fit = fit(kept, before.T_object_robot, task.touch_sd())};
  }
  /// The same with all parts climbed from one pose.
  std::optional<Explanation> moved(const Pose& from) const {
    const std::vector<PlacedPeak> here(touches_.size() + 1, {from, 0.0});
    return moved({here, here}, std::log(near_places));
  }
  /// Looks at places in the whole region, coarsely; none where there are too many. Touches are
  /// added one by one from either end as long as a place is not far worse than the best for as
  /// many.
  std::optional<Parts> coarse_parts() const {
    const std::vector<Pose> at(1);
    constexpr std::array steps{1.25, 1.25, 0.125};  // mm, mm, rad
    constexpr std::int64_t most_places = 400'000;
    constexpr double hopeless = 30.0;  // nats; more than the coarse steps cost
    PoseLattice places = question_.recogniser.lattice();
    for (const auto& [axis, step] : {std::pair{&places.x_mm, steps[0]},
                                     {&places.y_mm, steps[1]},
                                     {&places.theta_rad, steps[2]}}) {
      axis->count = std::max(static_cast<int>(std::ceil((axis->upper - axis->lower) / step)), 1);
    }
    if (places.bins() > most_places) {
      return {};
    }
    const std::size_t n = touches_.size();
    const PlacedPeak none{{}, log_zero};
    Parts best{std::vector<PlacedPeak>(n + 1, none), std::vector<PlacedPeak>(n + 1, none)};
    for (std::int64_t place = 0; place < places.bins(); ++place) {
      const Pose to = places.T_object_robot(place);
      const auto add_up = [&](std::vector<PlacedPeak>& parts, bool backwards) {
        double nats = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
          const std::size_t touch = backwards ? n - 1 - i : i;
          nats += placed_.log_likelihood(to, at, {touch, touch + 1});
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
  /// Of the places that suit the first touches or the last, the one that suits all where each may
  /// lie a millimetre beside its place.
  Pose best_start(const Parts& parts) const {
    const auto at = displacement_points({1.0, usual_rad_per_mm}, 32);
    PlacedPeak best{{}, log_zero};
    for (const std::vector<PlacedPeak>* of : {&parts.before, &parts.from}) {
      for (const PlacedPeak& part : *of) {
        const double nats = part.nats == log_zero
                                ? log_zero
                                : placed_.log_likelihood(part.T_object_robot, at, all_);
        if (nats > best.nats) {
          best = {part.T_object_robot, nats};
        }
      }
    }
    return best.T_object_robot;
  }

 private:
  /// The log evidence of a peak, on the scale of Estimate::log_evidence.
  double log_evidence(double nats, double log_volume) const {
    return nats + log_volume - question_.log_bin() + question_.offset +
           question_.log_weight[object_];
  }
  /// Touches that lie this far beside their places, with the turn that the task has per mm.
  DisplacementSd displacement_of(double mm) const {
    const DisplacementSd told = question_.task.touch_sd();
    const bool both = told.mm > 0.0 && told.rad > 0.0;
    return {mm, (both ? told.rad / told.mm : usual_rad_per_mm) * mm};
  }
  Fit fit(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
          DisplacementSd sd) const {
    const RecognitionTask& task = question_.task;
    const OccupancyGrid& map = task.hypotheses[object_].compared();
    return task.fit_scale().of(
        evidence_fit(touches, T_object_robot, map, task.contact(), sd, object_).value(),
        question_.in_contact);
  }

  const Question& question_;
  int object_;
  std::span<const TouchEvidence> touches_;
  PlacedTouches placed_;
  TouchRange all_{0, touches_.size()};
  std::vector<Pose> told_ = displacement_points(question_.task.touch_sd(), touch_sd_points);
};

/// The most probable hypotheses and where each explains the touches best.
std::vector<std::pair<int, Pose>> candidates(const Recogniser& recogniser, const Estimate& estimate,
                                             const RecognitionStep& step, double& share) {
  constexpr std::size_t limit = 5;
  std::vector<int> objects(estimate.log_evidence.size());
  std::iota(objects.begin(), objects.end(), 0);
  std::ranges::stable_sort(objects, std::greater<>(),
                           [&](int object) { return estimate.log_evidence[object]; });
  const auto own = std::ranges::find(objects, step.mode.object);
  std::rotate(objects.begin(), own, own + 1);
  objects.resize(std::min(objects.size(), limit));
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
  question.in_contact = touches_in_contact(touches);
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
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (touches[i].tells()) {
      question.touches.push_back(touches[i]);
      question.number.push_back(i + 1);
    }
  }
  question.log_weight = log_weights(task.hypotheses);
  question.offset = estimate.log_evidence[own] - question.log_weight[own] -
                    (step.mode.log_likelihood - std::log(share));
  if (!unexplained) {
    objects.resize(1);
  }
  const double temperature = task.temperature_after(touches);
  std::vector<Explainer> explainers;
  for (const auto& [object, from] : objects) {
    explainers.emplace_back(question, object);
  }
  const PlacedPeak peak = explainers.front().unmoved(objects.front().second);
  const double unmoved = explainers.front().log_evidence(peak);
  std::optional<Explanation> found;
  const auto consider = [&](const std::optional<Explanation>& one) {
    if (!one || one->fit.verdict == Verdict::does_not_fit ||
        (found && one->log_evidence <= found->log_evidence)) {
      return;
    }
    double lead = (one->log_evidence - unmoved) / temperature - least_nats;
    if (none) {
      const Tempering tempering = tempering_of(touches, task, one->fit);
      lead = tempering.tempered(one->log_evidence, task.label_of[one->placement.object]) -
             tempering.tempered(estimate.none_log_evidence.value_or(log_zero), step.best) -
             (one->placement.moved_after > 0 ? least_move_over_none_nats : 0.0);
    }
    if (lead > 0.0) {
      found = one;
    }
  };
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (unexplained || explainers[i].may_be_displaced(peak)) {
      consider(explainers[i].displaced(objects[i].second));
    }
    consider(explainers[i].moved(objects[i].second));
  }
  // Displacements would make a search through the region long.
  if (!found && unexplained && task.touch_sd().none()) {
    const double log_places =
        std::log(static_cast<double>(recogniser.lattice().bins())) + question.log_bin();
    for (const Explainer& explainer : explainers) {
      if (const auto parts = explainer.coarse_parts()) {
        consider(explainer.displaced(explainer.best_start(*parts)));
        consider(explainer.moved(*parts, log_places));
      }
    }
  }
  return found ? std::optional(found->placement) : std::nullopt;
}

PlacementWords words_of(const TouchPlacement& placement, const RecognitionTask& task) {
  const std::string name = task.name_of(placement.object);
  if (placement.moved_after > 0) {
    return {fmt::format("the object, {} by the touches, seems to have moved by {:.1f} mm after "
                        "touch {}",
                        name, placement.moved_mm, placement.moved_after),
            "hold it still, or recognise the touches before and after by themselves"};
  }
  return {fmt::format("the touches fit {} where each lies some {:.1f} mm beside the place that the "
                      "robot says",
                      name, placement.displaced.mm),
          fmt::format("is touch-sd too small? give `touch-sd-mm {:.1f}` `touch-sd-deg {:.1f}`",
                      placement.displaced.mm, 180.0 / std::numbers::pi * placement.displaced.rad)};
}

}  // namespace palpate
