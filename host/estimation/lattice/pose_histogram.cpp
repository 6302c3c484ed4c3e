#include "palpate/pose_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimation/bin_belief.hpp"
#include "estimation/change_in_steps.hpp"
#include "estimation/displacement_weights.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "estimation/lattice/expected_gain.hpp"
#include "estimation/lattice/refinement.hpp"
#include "estimation/lattice/touch_by_touch.hpp"
#include "estimation/log_sum.hpp"
#include "gpu/command_stream.hpp"
#include "model/own_process.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Throws Error where the device holds fewer bins, before there is a buffer of them.
void require_room(const gpu::Context& context, const HistogramOptions& options,
                  std::size_t objects) {
  constexpr double mib = 1 << 20;
  const PoseLattice& lattice = options.lattice;
  const int beliefs = TouchByTouch::wanted_by(options) ? 2 : 1;  // a touch by itself
  // In floating point: there may be too many bins to count.
  const double needed_mib = beliefs * (static_cast<double>(objects * sizeof(TwoFloat)) / mib) *
                            lattice.x_mm.count * lattice.y_mm.count * lattice.theta_rad.count;
  const double memory_mib = static_cast<double>(context.limits().memory) / mib;
  if (needed_mib > memory_mib) {
    throw Error(
        Fault::input,
        fmt::format("{} objects x {} x {} x {} pose bins need {:.0f} MiB, device '{}' has "
                    "{:.0f}; use fewer bins or objects",
                    objects, lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count,
                    std::ceil(needed_mib), context.name(), memory_mib));
  }
}

}  // namespace

struct PoseHistogram::Impl {
  Impl(Device& device, std::span<const Hypothesis> hypotheses, const HistogramOptions& wanted)
      : options(wanted),
        stream(device.context()),
        belief(device.context(), stream, options.lattice, hypotheses.size()),
        likelihood(device.context(), stream, belief, hypotheses, options.lattice, options.contact),
        predicted(hypotheses, options.contact),
        log_weight(log_weights(hypotheses)) {
    for (const Hypothesis& hypothesis : hypotheses) {
      bodies.push_back(displaced_body(hypothesis.map));
    }
    if (TouchByTouch::wanted_by(options)) {
      by_touch.emplace(device.context(), stream, options, hypotheses, log_weight, belief);
    }
    if (options.none_weight) {
      none_log_weight = palpate::none_log_weight(*options.none_weight, hypotheses, options.lattice);
    }
    summaries();  // runs what was recorded, and the reductions a first time
  }

  /// Eq. 13: the log-belief of a bin is the sum of the touches' log-likelihoods there (Eq. 7).
  void update(std::span<const TouchEvidence> touches, const std::function<void(double)>& progress) {
    if (!by_touch) {
      gather(touches);  // where memory ends, the belief stays as it was
    }
    change.change([&] {
      touched = touched || !touches.empty();
      summarised.reset();
      if (!by_touch) {
        likelihood.accumulate(known, belief, progress);
        return;
      }
      for (std::size_t i = 0; i < touches.size(); ++i) {
        gather(touches.subspan(i, 1));
        const auto evaluate = [&](const DenseBelief& uniform) {
          likelihood.accumulate(known, uniform, {});
        };
        // std::function would allocate a copy of it.
        by_touch->update(touches[i], std::cref(evaluate), belief);
        if (progress) {
          progress(static_cast<double>(i + 1) / static_cast<double>(touches.size()));
        }
      }
    });
  }

  void gather(std::span<const TouchEvidence> touches) {
    known = gathered(touches, options.lattice.pivot_mm, likelihood.longest_run(), std::move(known));
    prior_log_likelihood += palpate::prior_log_likelihood(known, options.contact);
  }

  /// The largest bin and the sum of every object; reduced once after each update.
  const std::vector<BeliefSummary>& summaries() {
    return summarised ? *summarised : summarised.emplace(belief.summarise());
  }

  /// What is to be added to the log-likelihoods that the belief holds of an object.
  double lost_mass(std::size_t object) const {
    return by_touch ? by_touch->lost_mass()[object] : 0.0;
  }

  /// Log of every object's prior weight times the summed likelihood of its bins.
  std::vector<double> log_evidence() {
    std::vector<double> log_evidence;
    for (std::size_t i = 0; i < log_weight.size(); ++i) {
      const BeliefSummary& summary = summaries()[i];
      log_evidence.push_back(log_weight[i] + lost_mass(i) + summary.max.value() +
                             std::log(summary.sum));
    }
    return log_evidence;
  }

  /// Log evidence of "none of these", where the options ask for it.
  double none_log_evidence() const { return *none_log_weight + by_touch->none_log_evidence(); }

  BinBelief bins() {
    BinBelief all{.lattice = options.lattice,
                  .objects = {},
                  .visit = [this](std::span<const int> objects, const BlockChoice& choice,
                                  const BinVisitor& visitor) {
                    for (const int object : objects) {
                      belief.visit(static_cast<std::size_t>(object), summaries()[object], choice,
                                   visitor);
                    }
                  }};
    const std::vector<double> identity = normalised(log_evidence());
    for (std::size_t i = 0; i < identity.size(); ++i) {
      const BeliefSummary& summary = summaries()[i];
      all.objects.push_back({.reference = summary.max.value(),
                             .log_share = -std::log(summary.sum),
                             .log_identity = std::log(identity[i])});
    }
    if (none_log_weight) {
      LogSum objects;
      for (const double of_object : log_evidence()) {
        objects.add(of_object);
      }
      all.log_objects = objects.log() - log_add(objects.log(), none_log_evidence());
    }
    return all;
  }

  /// Eq. 14: an object's evidence over the sum for all objects and, where the options ask for it,
  /// "none of these", which stands last.
  std::vector<double> identity() {
    std::vector<double> evidence = log_evidence();
    if (none_log_weight) {
      evidence.push_back(none_log_evidence());
    }
    return normalised(std::move(evidence));
  }

  Estimate estimate() {
    Estimate all{
        .identity = identity(), .log_evidence = log_evidence(), .mode = {}, .contradicted = true};
    // Eq. 15-16: the bin of the largest posterior probability; of equal bins the first object's.
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < log_weight.size(); ++i) {
      const BeliefSummary& summary = summaries()[i];
      const double best = summary.max.value() + lost_mass(i);
      all.contradicted = all.contradicted && prior_log_likelihood - best > contradiction_nats;
      if (log_weight[i] + best > largest) {
        largest = log_weight[i] + best;
        all.mode = {.object = static_cast<int>(i),
                    .bin = summary.arg_max,
                    .T_object_robot = options.lattice.T_object_robot(summary.arg_max),
                    .log_likelihood = best};
      }
    }
    if (none_log_weight) {
      all.none = all.identity.back();
      all.identity.pop_back();
      all.none_log_evidence = none_log_evidence();
    }
    return all;
  }

  HistogramOptions options;
  gpu::CommandStream stream;
  DenseBelief belief;
  DenseLikelihood likelihood;
  std::vector<TouchEvidence> classified;  ///< room for touches that are not classified
  KnownElements known;                    ///< of what is being taken in
  PredictedReadings predicted;            ///< of touches that are only imagined
  std::vector<double> log_weight;
  std::optional<TouchByTouch> by_touch;   ///< where the options need each touch by itself
  std::optional<double> none_log_weight;  ///< log of its prior weight times the number of bins
  double prior_log_likelihood = 0.0;      ///< of all touches, by a map that holds only the prior
  std::vector<Body> bodies;
  bool touched = false;  ///< since reset()
  std::optional<std::vector<BeliefSummary>> summarised;
  ChangeInSteps change{"histogram: an update was broken off half-way; call reset()"};
  OwnProcess process;
};

PoseHistogram::PoseHistogram(Device& device, std::span<const Hypothesis> hypotheses,
                             const HistogramOptions& options) {
  validate_hypotheses(hypotheses);
  HistogramOptions checked = options;
  checked.lattice.collapse_fixed().validate();
  validate_displacement(checked.touch_sd, checked.lattice, "touch_sd");
  validate_displacement(checked.slip_sd, checked.lattice, "slip_sd");
  checked.contact = resolve(options.contact, hypotheses);
  if (checked.none_weight && !(*checked.none_weight > 0.0 && std::isfinite(*checked.none_weight))) {
    throw Error(Fault::input, fmt::format("none_weight = {}: give a positive number, or none",
                                          *checked.none_weight));
  }
  require_room(device.context(), checked, hypotheses.size());
  impl_ = {new Impl(device, hypotheses, checked), delete_here<Impl>};
}

PoseHistogram::Impl& PoseHistogram::impl() const { return held_here(impl_, "histogram"); }

PoseHistogram::Impl& PoseHistogram::unbroken() const {
  Impl& held = impl();
  held.change.refuse();
  return held;
}

void PoseHistogram::reset() {
  Impl& histogram = impl();
  histogram.change.forget();
  histogram.change.change([&] {
    histogram.belief.clear();
    // Now, or a device that fails later would leave the old belief behind a reset.
    histogram.stream.run();
    histogram.touched = false;
    histogram.prior_log_likelihood = 0.0;
    if (histogram.by_touch) {
      histogram.by_touch->reset();
    }
    histogram.summarised.reset();
  });
}

void PoseHistogram::move_pivot(const glm::dvec2& pivot_mm) {
  Impl& histogram = unbroken();
  histogram.options.lattice =
      with_pivot(histogram.options.lattice, pivot_mm, "histogram", histogram.touched);
}

void PoseHistogram::update(std::span<const Touch> touches,
                           const std::function<void(double)>& progress) {
  // All touches are classified before the first is added: one that is not sound refuses all.
  update(evidence_of(touches, unbroken().options.contact, impl_->classified), progress);
}

void PoseHistogram::update(std::span<const TouchEvidence> touches,
                           const std::function<void(double)>& progress) {
  unbroken().update(touches, progress);
}

Estimate PoseHistogram::estimate() const { return unbroken().estimate(); }

RefinedPose PoseHistogram::refine(const Mode& mode) const {
  Impl& histogram = unbroken();
  require_object(mode.object, histogram.bodies.size());
  return palpate::refine(
      [&](std::span<const BinBox> boxes) { return histogram.belief.download(boxes); }, lattice(),
      histogram.bodies[mode.object], mode);
}

Marginals PoseHistogram::marginals(int object) const {
  return unbroken().bins().marginals(object, lattice());
}

std::vector<std::vector<BinShare>> PoseHistogram::likely_bins(std::span<const int> objects,
                                                              double least_share) const {
  return unbroken().bins().likely_bins(objects, least_share);
}

std::vector<double> PoseHistogram::log_likelihood(int object) const {
  Impl& histogram = unbroken();
  require_object(object, histogram.bodies.size());
  std::vector<BinBox> all;
  for (int theta = 0; theta < lattice().theta_rad.count; ++theta) {
    all.push_back(whole_plane(lattice(), theta, object));
  }
  std::vector<double> logs = histogram.belief.download(all);
  if (const double lost = histogram.lost_mass(static_cast<std::size_t>(object)); lost != 0.0) {
    for (double& log_likelihood : logs) {
      log_likelihood += lost;
    }
  }
  return logs;
}

double PoseHistogram::entropy() const { return unbroken().bins().entropy(); }

std::vector<PoseSample> PoseHistogram::sample(std::size_t count, std::uint64_t seed) const {
  return unbroken().bins().sample(count, seed);
}

std::vector<TouchGain> PoseHistogram::expected_gain(std::span<const Pose> T_robot_sensor,
                                                    std::span<const glm::dvec2> elements_mm,
                                                    const PlanOptions& plan) const {
  Impl& histogram = unbroken();
  require_plan(T_robot_sensor, elements_mm, plan, histogram.log_weight.size());
  std::vector<PoseSample> samples = sample(plan.samples, plan.seed);
  if (histogram.touched) {  // the object slips between touches, not before the first
    slip(samples, histogram.bodies, histogram.options.slip_sd, plan.seed);
  }
  return palpate::expected_gain(histogram.predicted, samples, T_robot_sensor, elements_mm,
                                histogram.options.touch_sd, plan);
}

const PoseLattice& PoseHistogram::lattice() const { return impl().options.lattice; }

std::vector<std::string> PoseHistogram::paths() const { return impl().likelihood.paths(); }

std::uint64_t PoseHistogram::device_bytes() const {
  const Impl& histogram = impl();
  return histogram.belief.device_bytes() + histogram.likelihood.device_bytes() +
         (histogram.by_touch ? histogram.by_touch->device_bytes() : 0);
}

}  // namespace palpate
