#include "palpate/pose_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "command_stream.hpp"
#include "contradiction.hpp"
#include "dense_belief.hpp"
#include "dense_likelihood.hpp"
#include "half_done.hpp"
#include "hypotheses.hpp"
#include "memory_plan.hpp"
#include "moved_from.hpp"
#include "palpate/error.hpp"
#include "refinement.hpp"

namespace palpate {

namespace {

/// An array at rest and the log-likelihood of its reading No Contact everywhere.
struct StillArray {
  explicit StillArray(DenseBelief belief) : no_contact(std::move(belief)) {}

  bool holds(const Touch& touch) const {
    return evaluated && same_placement(touch, {T_robot_sensor, elements_mm, {}});
  }

  bool evaluated = false;
  Pose T_robot_sensor;
  std::vector<glm::dvec2> elements_mm;
  DenseBelief no_contact;
};

/// What a touch says, and how an array at rest takes it in.
struct StillTouch {
  bool by_differences = false;  ///< from No Contact everywhere, or else all of it
  ContactEvidence evidence;
};

/// A touch that may come next and its log-likelihood.
struct PreparedTouch {
  explicit PreparedTouch(DenseBelief belief) : log_likelihood(std::move(belief)) {}

  std::optional<ContactEvidence> evidence;  ///< none while it is not sound
  DenseBelief log_likelihood;
};

}  // namespace

struct PoseHistogram::Impl {
  Impl(Device& device, std::span<const Hypothesis> hypotheses, const HistogramOptions& wanted,
       const ContactLikelihood& model)
      : options(wanted),
        prior_model(model),
        context(device.context()),
        plan(plan_memory(context, hypotheses, options)),
        stream(context),
        belief(context, stream, options.lattice, hypotheses.size()),
        likelihood(context, stream, belief, hypotheses, options.lattice, model,
                   plan.batch_elements),
        log_weight(log_weights(hypotheses)) {
    for (const Hypothesis& hypothesis : hypotheses) {
      bodies.push_back(displaced_body(hypothesis.map));
    }
    if (options.none_weight) {
      none_log_weight = std::log(*options.none_weight) - log_total_weight(hypotheses) +
                        std::log(static_cast<double>(options.lattice.bins()));
    }
    summaries();  // runs what was recorded, and the reductions a first time
  }

  /// The reductions of the belief as it is now; kept until the next touch.
  const std::vector<BeliefSummary>& summaries() {
    if (!summarised) {
      summarised = belief.summarise();
    }
    return *summarised;
  }

  /// log of each object's prior weight times the summed likelihood of its bins.
  std::vector<double> log_evidence() {
    std::vector<double> logs;
    for (std::size_t i = 0; i < log_weight.size(); ++i) {
      const BeliefSummary& summary = summaries()[i];
      logs.push_back(log_weight[i] + summary.max.value() + std::log(summary.sum));
    }
    return logs;
  }

  /// Eq. 14, as a log-sum-exp over objects and, where it is asked for, "none of these": the last.
  std::vector<double> identity() {
    std::vector<double> probability = log_evidence();
    if (none_log_weight) {
      probability.push_back(*none_log_weight + prior_log_likelihood);
    }
    const double most = *std::max_element(probability.begin(), probability.end());
    double total = 0.0;
    for (double& p : probability) {
      p = std::exp(p - most);
      total += p;
    }
    for (double& p : probability) {
      p /= total;
    }
    return probability;
  }

  void require_object(int object) const {
    if (object < 0 || static_cast<std::size_t>(object) >= log_weight.size()) {
      throw Error(Fault::input, fmt::format("object {}: there are {}, counted from 0", object,
                                            log_weight.size()));
    }
  }

  ContactEvidence evidence_of(std::span<const Touch> touches) const {
    return gather_evidence(touches, options.classifier, options.lattice.pivot_mm,
                           likelihood.segment_elements());
  }

  void prepare(const Touch& touch) {
    half_done.refuse();
    ContactEvidence evidence = evidence_of(std::span(&touch, 1));
    if (!prepared) {
      try {
        prepared.emplace(DenseBelief(context, stream, options.lattice, log_weight.size()));
      } catch (const Error&) {
        // Others on the device have taken what the plan counted on; it works without, too.
        plan.room_to_prepare = false;
        return;
      }
    }
    // A device that fails also drops what reset() has recorded of the belief.
    half_done.change([&] {
      prepared->evidence.reset();
      prepared->log_likelihood.clear();
      likelihood.accumulate(evidence, prepared->log_likelihood, {});
      prepared->evidence = std::move(evidence);
    });
  }

  void update(std::span<const Touch> touches, const std::function<void(double)>& progress) {
    half_done.refuse();
    // All of them before the first is taken in, for one that is not sound refuses all.
    std::vector<StillTouch> still_touches;
    ContactEvidence evidence;
    if (options.still_array) {
      for (const Touch& touch : touches) {
        still_touches.push_back(look_at(touch));
      }
    } else {
      evidence = evidence_of(touches);
    }
    half_done.change([&] {
      summarised.reset();
      if (options.still_array) {
        update_still(touches, still_touches, progress);
      } else {
        update_plain(evidence, progress);
      }
      for (const Touch& touch : touches) {
        prior_log_likelihood +=
            palpate::prior_log_likelihood(touch, options.classifier, prior_model);
      }
    });
  }

  /// Adds touches element by element, unless they were prepared.
  void update_plain(const ContactEvidence& evidence, const std::function<void(double)>& progress) {
    if (prepared && prepared->evidence == evidence) {
      belief.add(prepared->log_likelihood);
      stream.run();
      if (progress) {
        progress(1.0);
      }
    } else {
      likelihood.accumulate(evidence, belief, progress);
    }
  }

  /// A touch as what it says beyond No Contact everywhere, where that is less.
  StillTouch look_at(const Touch& touch) const {
    const std::vector<Reading> readings = options.classifier.classify(touch);
    const auto no_contact = std::count(readings.begin(), readings.end(), Reading::no_contact);
    if (2 * static_cast<std::size_t>(no_contact) < readings.size()) {
      return {false, evidence_of(std::span(&touch, 1))};
    }
    return {true, gather_differences(touch, options.classifier, options.lattice.pivot_mm,
                                     likelihood.segment_elements())};
  }

  void update_still(std::span<const Touch> touches, std::span<const StillTouch> still_touches,
                    const std::function<void(double)>& progress) {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (still_touches[i].by_differences) {
        rest_at(touches[i]);
        belief.add(still->no_contact);
      }
      likelihood.accumulate(still_touches[i].evidence, belief, {});
      if (progress) {
        progress(static_cast<double>(i + 1) / static_cast<double>(touches.size()));
      }
    }
  }

  /// Evaluates No Contact everywhere where the array was not before.
  void rest_at(const Touch& touch) {
    if (still && still->holds(touch)) {
      return;
    }
    if (!still) {
      still.emplace(DenseBelief(context, stream, options.lattice, log_weight.size()));
    }
    still->evaluated = false;
    still->no_contact.clear();
    likelihood.accumulate(
        gather_no_contact(touch, options.lattice.pivot_mm, likelihood.segment_elements()),
        still->no_contact, {});
    still->T_robot_sensor = touch.T_robot_sensor;
    still->elements_mm.assign(touch.elements_mm.begin(), touch.elements_mm.end());
    still->evaluated = true;
  }

  /// Scales sums relative to an object's largest bin to that object's probability.
  std::vector<double> to_probability(int object, std::vector<double> sums) {
    const double scale = identity()[object] / summaries()[object].sum;
    for (double& sum : sums) {
      sum *= scale;
    }
    return sums;
  }

  HistogramOptions options;
  ContactLikelihood prior_model;
  gpu::Context& context;
  MemoryPlan plan;
  gpu::CommandStream stream;
  DenseBelief belief;
  DenseLikelihood likelihood;
  std::optional<StillArray> still;
  std::optional<PreparedTouch> prepared;
  std::vector<double> log_weight;
  std::optional<double> none_log_weight;  ///< times the number of bins
  double prior_log_likelihood = 0.0;      ///< of all touches, by the prior alone
  std::vector<Body> bodies;
  std::optional<std::vector<BeliefSummary>> summarised;
  HalfDone half_done{
      "histogram: an update or a prepared touch was broken off half-way; call reset()"};
};

PoseHistogram::PoseHistogram(Device& device, std::span<const Hypothesis> hypotheses,
                             const HistogramOptions& options) {
  validate_hypotheses(hypotheses);
  HistogramOptions checked = options;
  checked.lattice.collapse_fixed().validate();
  checked.classifier.validate();
  const ContactLikelihood model{.gamma = checked.gamma,
                                .prior = checked.prior ? *checked.prior : common_prior(hypotheses)};
  model.validate();
  if (checked.none_weight && !(*checked.none_weight > 0.0 && std::isfinite(*checked.none_weight))) {
    throw Error(Fault::input, fmt::format("none_weight = {}: give a positive number, or none",
                                          *checked.none_weight));
  }
  impl_ = std::make_unique<Impl>(device, hypotheses, checked, model);
}

PoseHistogram::~PoseHistogram() = default;
PoseHistogram::PoseHistogram(PoseHistogram&&) noexcept = default;
PoseHistogram& PoseHistogram::operator=(PoseHistogram&&) noexcept = default;

PoseHistogram::Impl& PoseHistogram::impl() const { return held_by(impl_, "histogram"); }

PoseHistogram::Impl& PoseHistogram::whole() const {
  Impl& held = impl();
  held.half_done.refuse();
  return held;
}

void PoseHistogram::reset() {
  Impl& histogram = impl();
  histogram.half_done.forget();
  histogram.half_done.change([&] {
    histogram.belief.clear();
    // Now, or a device that fails later would leave the old belief behind a reset.
    histogram.stream.run();
    histogram.prior_log_likelihood = 0.0;
    histogram.summarised.reset();
  });
}

void PoseHistogram::update(std::span<const Touch> touches,
                           const std::function<void(double)>& progress) {
  impl().update(touches, progress);
}

void PoseHistogram::prepare(const Touch& touch) {
  if (Impl& histogram = impl(); histogram.plan.room_to_prepare) {
    histogram.prepare(touch);
  }
}

Estimate PoseHistogram::estimate() const {
  Impl& histogram = whole();
  Estimate estimate{.identity = histogram.identity(), .mode = {}};
  if (histogram.none_log_weight) {
    estimate.none = estimate.identity.back();
    estimate.identity.pop_back();
  }
  const std::vector<BeliefSummary>& summaries = histogram.summaries();
  double most = -std::numeric_limits<double>::infinity();
  double best = most;
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    const double log_likelihood = summaries[i].max.value();
    best = std::max(best, log_likelihood);
    if (histogram.log_weight[i] + log_likelihood > most) {
      most = histogram.log_weight[i] + log_likelihood;
      estimate.mode = {.object = static_cast<int>(i),
                       .bin = summaries[i].arg_max,
                       .T_object_robot = lattice().T_object_robot(summaries[i].arg_max),
                       .log_likelihood = log_likelihood};
    }
  }
  estimate.contradicted = histogram.prior_log_likelihood - best > contradiction_nats;
  return estimate;
}

RefinedPose PoseHistogram::refine(const Mode& mode) const {
  Impl& histogram = whole();
  histogram.require_object(mode.object);
  if (mode.bin < 0 || mode.bin >= lattice().bins()) {
    throw Error(Fault::input,
                fmt::format("bin {}: there are {}, counted from 0", mode.bin, lattice().bins()));
  }
  return palpate::refine(histogram.belief, lattice(), static_cast<std::size_t>(mode.object),
                         histogram.bodies[mode.object], mode.bin);
}

Marginals PoseHistogram::marginals(int object) const {
  Impl& histogram = whole();
  histogram.require_object(object);
  BeliefMarginals sums = histogram.belief.marginals(object, histogram.summaries()[object].max);
  return {.xy = histogram.to_probability(object, std::move(sums.xy)),
          .theta = histogram.to_probability(object, std::move(sums.theta))};
}

std::vector<double> PoseHistogram::log_likelihood(int object) const {
  Impl& histogram = whole();
  histogram.require_object(object);
  return histogram.belief.download(object);
}

const PoseLattice& PoseHistogram::lattice() const { return impl().options.lattice; }

std::vector<std::string> PoseHistogram::paths() const { return impl().likelihood.paths(); }

std::uint64_t PoseHistogram::device_bytes() const {
  const Impl& histogram = impl();
  const std::uint64_t still = histogram.still ? histogram.still->no_contact.device_bytes() : 0;
  const std::uint64_t prepared =
      histogram.prepared ? histogram.prepared->log_likelihood.device_bytes() : 0;
  return histogram.belief.device_bytes() + still + prepared + histogram.likelihood.device_bytes();
}

}  // namespace palpate
