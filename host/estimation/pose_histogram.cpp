#include "palpate/pose_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "belief.hpp"
#include "command_stream.hpp"
#include "contradiction.hpp"
#include "dense_likelihood.hpp"
#include "hypotheses.hpp"
#include "memory_plan.hpp"
#include "palpate/error.hpp"
#include "refinement.hpp"

namespace palpate {

namespace {

/// An array at rest and the log-likelihood of its reading No Contact everywhere.
struct StillArray {
  explicit StillArray(Belief belief) : no_contact(std::move(belief)) {}

  bool holds(const Touch& touch) const {
    return same_placement(touch, {T_robot_sensor, elements_mm, {}});
  }

  Pose T_robot_sensor;
  std::vector<glm::dvec2> elements_mm;
  Belief no_contact;
};

/// A touch that may come next and its log-likelihood.
struct PreparedTouch {
  explicit PreparedTouch(Belief belief) : log_likelihood(std::move(belief)) {}

  std::optional<ContactEvidence> evidence;  ///< none while it is not sound
  Belief log_likelihood;
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

  void add_to_prior(const Touch& touch) {
    prior_log_likelihood += palpate::prior_log_likelihood(touch, options.classifier, prior_model);
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
    ContactEvidence evidence = evidence_of(std::span(&touch, 1));
    if (!prepared) {
      try {
        prepared.emplace(Belief(context, stream, options.lattice, log_weight.size()));
      } catch (const Error&) {
        // Others on the device have taken what the plan counted on; it works without, too.
        plan.room_to_prepare = false;
        return;
      }
    }
    prepared->evidence.reset();
    prepared->log_likelihood.clear();
    likelihood.accumulate(evidence, prepared->log_likelihood, {});
    prepared->evidence = std::move(evidence);
  }

  /// Adds touches element by element, unless they were prepared.
  void update_plain(std::span<const Touch> touches, const std::function<void(double)>& progress) {
    const ContactEvidence evidence = evidence_of(touches);
    if (prepared && prepared->evidence == evidence) {
      belief.add(prepared->log_likelihood);
      stream.run();
      if (progress) {
        progress(1.0);
      }
    } else {
      likelihood.accumulate(evidence, belief, progress);
    }
    for (const Touch& touch : touches) {
      add_to_prior(touch);
    }
  }

  /// Adds a touch as what it says beyond No Contact everywhere, where that is less.
  void update_still(const Touch& touch) {
    const std::vector<Reading> readings = options.classifier.classify(touch);
    const auto no_contact = std::count(readings.begin(), readings.end(), Reading::no_contact);
    if (2 * static_cast<std::size_t>(no_contact) < readings.size()) {
      update_plain(std::span(&touch, 1), {});
      return;
    }
    const glm::dvec2& pivot_mm = options.lattice.pivot_mm;
    if (!still || !still->holds(touch)) {
      if (!still) {
        still.emplace(Belief(context, stream, options.lattice, log_weight.size()));
      }
      still->elements_mm.clear();
      still->no_contact.clear();
      likelihood.accumulate(gather_no_contact(touch, pivot_mm, likelihood.segment_elements()),
                            still->no_contact, {});
      still->T_robot_sensor = touch.T_robot_sensor;
      still->elements_mm.assign(touch.elements_mm.begin(), touch.elements_mm.end());
    }
    belief.add(still->no_contact);
    likelihood.accumulate(
        gather_differences(touch, options.classifier, pivot_mm, likelihood.segment_elements()),
        belief, {});
    add_to_prior(touch);
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
  Belief belief;
  DenseLikelihood likelihood;
  std::optional<StillArray> still;
  std::optional<PreparedTouch> prepared;
  std::vector<double> log_weight;
  std::optional<double> none_log_weight;  ///< times the number of bins
  double prior_log_likelihood = 0.0;      ///< of all touches, by the prior alone
  std::vector<Body> bodies;
  std::optional<std::vector<BeliefSummary>> summarised;
};

PoseHistogram::PoseHistogram(Device& device, std::span<const Hypothesis> hypotheses,
                             const HistogramOptions& options) {
  validate_hypotheses(hypotheses);
  HistogramOptions checked = options;
  checked.lattice.collapse_fixed().validate();
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

void PoseHistogram::reset() {
  impl_->belief.clear();
  impl_->prior_log_likelihood = 0.0;
  impl_->summarised.reset();
}

void PoseHistogram::update(std::span<const Touch> touches,
                           const std::function<void(double)>& progress) {
  impl_->summarised.reset();
  if (impl_->options.still_array) {
    for (std::size_t i = 0; i < touches.size(); ++i) {
      impl_->update_still(touches[i]);
      if (progress) {
        progress(static_cast<double>(i + 1) / static_cast<double>(touches.size()));
      }
    }
    return;
  }
  impl_->update_plain(touches, progress);
}

void PoseHistogram::prepare(const Touch& touch) {
  if (impl_->plan.room_to_prepare) {
    impl_->prepare(touch);
  }
}

Estimate PoseHistogram::estimate() const {
  Estimate estimate{.identity = impl_->identity(), .mode = {}};
  if (impl_->none_log_weight) {
    estimate.none = estimate.identity.back();
    estimate.identity.pop_back();
  }
  const std::vector<BeliefSummary>& summaries = impl_->summaries();
  double most = -std::numeric_limits<double>::infinity();
  double best = most;
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    const double log_likelihood = summaries[i].max.value();
    best = std::max(best, log_likelihood);
    if (impl_->log_weight[i] + log_likelihood > most) {
      most = impl_->log_weight[i] + log_likelihood;
      estimate.mode = {.object = static_cast<int>(i),
                       .bin = summaries[i].arg_max,
                       .T_object_robot = lattice().T_object_robot(summaries[i].arg_max),
                       .log_likelihood = log_likelihood};
    }
  }
  estimate.contradicted = impl_->prior_log_likelihood - best > contradiction_nats;
  return estimate;
}

RefinedPose PoseHistogram::refine(const Mode& mode) const {
  impl_->require_object(mode.object);
  if (mode.bin < 0 || mode.bin >= lattice().bins()) {
    throw Error(Fault::input,
                fmt::format("bin {}: there are {}, counted from 0", mode.bin, lattice().bins()));
  }
  return palpate::refine(impl_->belief, lattice(), static_cast<std::size_t>(mode.object),
                         impl_->bodies[mode.object], mode.bin);
}

Marginals PoseHistogram::marginals(int object) const {
  impl_->require_object(object);
  BeliefMarginals sums = impl_->belief.marginals(object, impl_->summaries()[object].max);
  return {.xy = impl_->to_probability(object, std::move(sums.xy)),
          .theta = impl_->to_probability(object, std::move(sums.theta))};
}

std::vector<double> PoseHistogram::log_likelihood(int object) const {
  impl_->require_object(object);
  return impl_->belief.download(object);
}

const PoseLattice& PoseHistogram::lattice() const { return impl_->options.lattice; }

std::vector<std::string> PoseHistogram::paths() const { return impl_->likelihood.paths(); }

std::uint64_t PoseHistogram::device_bytes() const {
  const std::uint64_t still = impl_->still ? impl_->still->no_contact.device_bytes() : 0;
  const std::uint64_t prepared =
      impl_->prepared ? impl_->prepared->log_likelihood.device_bytes() : 0;
  return impl_->belief.device_bytes() + still + prepared + impl_->likelihood.device_bytes();
}

}  // namespace palpate
