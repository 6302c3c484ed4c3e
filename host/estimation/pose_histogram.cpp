#include "palpate/pose_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "belief.hpp"
#include "command_stream.hpp"
#include "dense_likelihood.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// Sums of this many nats over any number of touches stay within float32.
constexpr float most_log_odds = 1e30F;

void validate(std::span<const Hypothesis> hypotheses) {
  if (hypotheses.empty()) {
    throw Error(Fault::input, "no objects: give at least one map");
  }
  for (const auto& [map, weight] : hypotheses) {
    if (map.nx < 1 || map.ny < 1 ||
        map.log_odds.size() != static_cast<std::size_t>(map.nx) * map.ny) {
      throw Error(Fault::input, fmt::format("map '{}': {} x {} cells but {} log odds", map.label,
                                            map.nx, map.ny, map.log_odds.size()));
    }
    if (!(map.cell_mm > 0.0) || !std::isfinite(map.cell_mm)) {
      throw Error(Fault::input, fmt::format("map '{}': cell_mm = {}: give a positive length",
                                            map.label, map.cell_mm));
    }
    if (!std::isfinite(map.origin_mm.x) || !std::isfinite(map.origin_mm.y)) {
      throw Error(Fault::input, fmt::format("map '{}': origin_mm = {},{}: give finite numbers",
                                            map.label, map.origin_mm.x, map.origin_mm.y));
    }
    if (!std::all_of(map.log_odds.begin(), map.log_odds.end(),
                     [](float l) { return std::abs(l) <= most_log_odds; })) {
      throw Error(Fault::input,
                  fmt::format("map '{}': log odds must be finite and within +-{:g}; build it anew",
                              map.label, most_log_odds));
    }
    if (!(weight > 0.0) || !std::isfinite(weight)) {
      throw Error(Fault::input,
                  fmt::format("map '{}': weight = {}: give a positive number, or leave the object "
                              "out",
                              map.label, weight));
    }
  }
}

double common_prior(std::span<const Hypothesis> hypotheses) {
  const OccupancyGrid& first = hypotheses.front().map;
  for (const Hypothesis& hypothesis : hypotheses) {
    // Readers may have rounded one of them.
    if (std::abs(hypothesis.map.prior - first.prior) > 1e-6) {
      throw Error(
          Fault::input,
          fmt::format("map '{}': prior {} differs from {} of map '{}'; build the maps "
                      "together, or say which prior to use",
                      hypothesis.map.label, hypothesis.map.prior, first.prior, first.label));
    }
  }
  return first.prior;
}

/// An array at rest and the log-likelihood of its reading No Contact everywhere.
struct StillArray {
  explicit StillArray(Belief belief) : no_contact(std::move(belief)) {}

  bool holds(const Touch& touch) const {
    return touch.T_robot_sensor.translation_mm == T_robot_sensor.translation_mm &&
           touch.T_robot_sensor.theta_rad == T_robot_sensor.theta_rad &&
           std::equal(touch.elements_mm.begin(), touch.elements_mm.end(), elements_mm.begin(),
                      elements_mm.end());
  }

  Pose T_robot_sensor;
  std::vector<glm::dvec2> elements_mm;
  Belief no_contact;
};

}  // namespace

struct PoseHistogram::Impl {
  Impl(Device& device, std::span<const Hypothesis> hypotheses, const HistogramOptions& wanted,
       const ContactLikelihood& model)
      : options(wanted),
        context(device.context()),
        stream(context),
        belief(context, stream, options.lattice, hypotheses.size()),
        likelihood(context, stream, belief, hypotheses, options.lattice, model) {
    double total = 0.0;
    for (const Hypothesis& hypothesis : hypotheses) {
      total += hypothesis.weight;
    }
    for (const Hypothesis& hypothesis : hypotheses) {
      log_weight.push_back(std::log(hypothesis.weight) - std::log(total));
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

  /// Eq. 14, as a log-sum-exp over objects.
  std::vector<double> identity() {
    std::vector<double> probability = log_evidence();
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

  /// Adds a touch element by element.
  void update_plain(std::span<const Touch> touches, const std::function<void(double)>& progress) {
    likelihood.accumulate(gather_evidence(touches, options.classifier, options.lattice.pivot_mm,
                                          likelihood.segment_elements()),
                          belief, progress);
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
  gpu::Context& context;
  gpu::CommandStream stream;
  Belief belief;
  DenseLikelihood likelihood;
  std::optional<StillArray> still;
  std::vector<double> log_weight;
  std::optional<std::vector<BeliefSummary>> summarised;
};

PoseHistogram::PoseHistogram(Device& device, std::span<const Hypothesis> hypotheses,
                             const HistogramOptions& options) {
  validate(hypotheses);
  HistogramOptions checked = options;
  checked.lattice.collapse_fixed().validate();
  const ContactLikelihood model{.gamma = checked.gamma,
                                .prior = checked.prior ? *checked.prior : common_prior(hypotheses)};
  model.validate();
  impl_ = std::make_unique<Impl>(device, hypotheses, checked, model);
}

PoseHistogram::~PoseHistogram() = default;
PoseHistogram::PoseHistogram(PoseHistogram&&) noexcept = default;
PoseHistogram& PoseHistogram::operator=(PoseHistogram&&) noexcept = default;

void PoseHistogram::reset() {
  impl_->belief.clear();
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

Estimate PoseHistogram::estimate() const {
  Estimate estimate{.identity = impl_->identity(), .mode = {}};
  const std::vector<BeliefSummary>& summaries = impl_->summaries();
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    const double log_likelihood = summaries[i].max.value();
    if (impl_->log_weight[i] + log_likelihood > most) {
      most = impl_->log_weight[i] + log_likelihood;
      estimate.mode = {.object = static_cast<int>(i),
                       .bin = summaries[i].arg_max,
                       .T_object_robot = lattice().T_object_robot(summaries[i].arg_max),
                       .log_likelihood = log_likelihood};
    }
  }
  return estimate;
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
  return impl_->belief.device_bytes() + still + impl_->likelihood.device_bytes();
}

}  // namespace palpate
