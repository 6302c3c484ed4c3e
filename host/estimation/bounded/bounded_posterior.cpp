#include "palpate/bounded_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "estimation/bounded/bounded_belief.hpp"
#include "estimation/bounded/search_memory.hpp"
#include "estimation/displacement_weights.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/lattice/expected_gain.hpp"
#include "estimation/lattice/refinement.hpp"
#include "estimation/log_sum.hpp"
#include "model/map_likelihood.hpp"
#include "model/own_process.hpp"
#include "model/refuse.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

void require_tolerance(double tolerance) {
  require(tolerance > 0.0 && tolerance < 1.0, "tolerance", tolerance,
          "give a share of the mass between 0 and 1, such as 1e-6");
}

/// The options, with what follows from them and the hypotheses.
/// @throws Error where they are not sound, or need more memory than a search may take
BoundedOptions checked(const BoundedOptions& options, std::span<const Hypothesis> hypotheses) {
  validate_hypotheses(hypotheses);
  require_tolerance(options.tolerance);
  const auto require_positive = [](const std::optional<double>& value, const char* field,
                                   const char* remedy) {
    require(!value || (*value > 0.0 && std::isfinite(*value)), field, value.value_or(0.0), remedy);
  };
  require_positive(options.budget_s, "budget_s", "give a positive number of seconds, or none");
  require_positive(options.evidence_nats, "evidence_nats",
                   "give a positive number of nats, or none");
  require(options.evidence_growth >= 0.0 && std::isfinite(options.evidence_growth),
          "evidence_growth", options.evidence_growth, "give a number from 0");
  require_positive(options.none_weight, "none_weight", "give a positive number, or none");
  require(options.threads >= 0, "threads", options.threads, "give at least 1, or 0 for all cores");
  BoundedOptions all = options;
  all.lattice.collapse_fixed().validate();
  validate_displacement(all.touch_sd, all.lattice, "touch_sd");
  all.contact = resolve(options.contact, hypotheses);
  if (const std::string why = why_no_room(hypotheses, all, memory_for_search()); !why.empty()) {
    throw Error(Fault::input, why);
  }
  return all;
}

/// Bounds of every identity probability.
/// @param bounds [hypothesis] of the log evidence; `none` of "none of these"
std::vector<ProbabilityInterval> identity_bounds(std::span<const double> identity,
                                                 std::span<const LogInterval> bounds,
                                                 const LogInterval& none) {
  // Where nothing is known, an interval ends at 0 or 1.
  const auto probability = [](double own, double others) {
    const double p = 1.0 / (1.0 + std::exp(others - own));
    return std::isnan(p) ? std::optional<double>() : p;
  };
  std::vector<ProbabilityInterval> intervals;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    LogSum others_low;
    LogSum others_high;
    others_low.add(none.low);
    others_high.add(none.high);
    for (std::size_t other = 0; other < bounds.size(); ++other) {
      if (other != i) {
        others_low.add(bounds[other].low);
        others_high.add(bounds[other].high);
      }
    }
    // Rounding must not leave out what lies between them.
    intervals.push_back(
        {std::min(identity[i], probability(bounds[i].low, others_high.log()).value_or(0.0)),
         std::max(identity[i], probability(bounds[i].high, others_low.log()).value_or(1.0))});
  }
  return intervals;
}

}  // namespace

struct BoundedPosterior::Impl : BoundedBelief {
  Impl(std::span<const Hypothesis> objects, const BoundedOptions& checked_options)
      : BoundedBelief(objects, checked_options) {
    for (const Hypothesis& object : objects) {
      bodies.push_back(displaced_body(object.map));
    }
  }

  std::vector<Body> bodies;                    ///< [hypothesis]
  std::optional<PredictedReadings> predicted;  ///< once a gain is asked for
  OwnProcess process;
};

BoundedPosterior::BoundedPosterior(std::span<const Hypothesis> hypotheses,
                                   const BoundedOptions& options)
    : impl_(new Impl(hypotheses, checked(options, hypotheses)), delete_here<Impl>) {}

BoundedPosterior::Impl& BoundedPosterior::impl() const {
  return held_here(impl_, "bounded posterior");
}

BoundedPosterior::Impl& BoundedPosterior::with_touches_taken_in() const {
  Impl& belief = impl();
  belief.take_in();
  return belief;
}

void BoundedPosterior::reset() { impl().reset(); }

void BoundedPosterior::move_pivot(const glm::dvec2& pivot_mm) {
  with_touches_taken_in().move_pivot(pivot_mm);
}

void BoundedPosterior::update(std::span<const Touch> touches,
                              const std::function<void(double)>& progress) {
  BoundedBelief& belief = impl();
  if (progress) {
    progress(1.0);
  }
  belief.kept().add(touches, belief.options().contact);
}

void BoundedPosterior::update(std::span<const TouchEvidence> touches,
                              const std::function<void(double)>& progress) {
  BoundedBelief& belief = impl();
  if (progress) {
    progress(1.0);
  }
  belief.kept().add(touches);
}

Estimate BoundedPosterior::estimate(std::optional<double> tolerance) const {
  BoundedBelief& belief = with_touches_taken_in();
  if (tolerance) {
    require_tolerance(*tolerance);
  }
  const SearchResult& found = belief.found(tolerance.value_or(belief.options().tolerance));
  // Dropped and rounding mass over the whole that they are part of.
  const double dropped = found.unproven();
  Certificate certificate{.dropped_mass = std::isfinite(dropped) ? dropped / (1.0 + dropped) : 1.0,
                          .mode_certain = found.mode_certain,
                          .blocks_bounded = found.blocks_bounded,
                          .bins_evaluated = found.bins_evaluated};
  Estimate estimate{.mode = {.object = found.best_object,
                             .bin = found.best_bin,
                             .T_object_robot = lattice().T_object_robot(found.best_bin),
                             .log_likelihood = found.best_log_likelihood},
                    .contradicted = found.contradicted};
  for (const HypothesisMass& mass : found.mass) {
    estimate.log_evidence.push_back(mass.evaluated);
    certificate.log_evidence.push_back(mass.bounds());
  }
  std::vector<double> logs = estimate.log_evidence;
  const LogInterval none = belief.none_log_evidence();
  if (belief.has_none()) {
    certificate.none_log_evidence = none;
    estimate.none_log_evidence = belief.none_estimate();
    logs.push_back(*estimate.none_log_evidence);
  }
  estimate.identity = normalised(std::move(logs));
  if (belief.has_none()) {
    estimate.none = estimate.identity.back();
    estimate.identity.pop_back();
  }
  estimate.identity_bounds = identity_bounds(estimate.identity, certificate.log_evidence, none);
  estimate.certificate = std::move(certificate);
  return estimate;
}

RefinedPose BoundedPosterior::refine(const Mode& mode) const {
  const Impl& belief = with_touches_taken_in();
  require_object(mode.object, belief.hypotheses().size());
  // Where bins are very fine, a few of them tell the peak, and all would take long. A mean over
  // displacements takes the others all the same.
  const PoseLattice fit = belief.options().touch_sd.none() ? thinned(lattice()) : lattice();
  std::optional<BinLikelihood> of_fit;
  Mode start = mode;
  if (fit.plane() != lattice().plane()) {
    of_fit.emplace(belief.hypotheses(), belief.options().contact, fit);
    if (mode.bin && *mode.bin >= 0 && *mode.bin < lattice().bins()) {
      start.bin = fit.bin_of(lattice().T_object_robot(*mode.bin));
    }
  }
  const BinLikelihood& likelihood = of_fit ? *of_fit : belief.likelihood();
  return palpate::refine(
      [&](std::span<const BinBox> boxes) { return belief.log_likelihood(boxes, likelihood); }, fit,
      belief.bodies[mode.object], start);
}

Marginals BoundedPosterior::marginals(int object) const { return marginals(object, lattice()); }

Marginals BoundedPosterior::marginals(int object, const PoseLattice& grid) const {
  return with_touches_taken_in().bins().marginals(object, grid);
}

std::vector<std::vector<BinShare>> BoundedPosterior::likely_bins(std::span<const int> objects,
                                                                 double least_share) const {
  return with_touches_taken_in().bins().likely_bins(objects, least_share);
}

EvaluatedBelief BoundedPosterior::evaluated_bins() const {
  BoundedBelief& belief = with_touches_taken_in();
  const SearchResult& found = belief.found();
  struct Bin {
    std::int64_t place;
    double log_likelihood;
  };
  const double list_bytes = 2.0 * sizeof(Bin) * static_cast<double>(found.bins_evaluated);
  if (list_bytes > static_cast<double>(memory_for_search())) {
    throw Error(
        Fault::input,
        fmt::format("the list of {} evaluated bins takes {:.0f} MiB, more than a quarter of "
                    "the machine's memory: use fewer bins, more touches or a budget",
                    found.bins_evaluated, list_bytes / (1 << 20)));
  }
  std::vector<Bin> bins;
  LogSum off_map;
  belief.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    if (static_cast<std::int64_t>(log_likelihood.size()) != box.bins()) {
      off_map.add(belief.log_weight()[box.object] + log_likelihood[0] +
                  std::log(static_cast<double>(box.bins())));
      return;
    }
    const std::int64_t first = box.object * lattice().bins();
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      bins.push_back({first + box.bin(i, lattice()), log_likelihood[static_cast<std::size_t>(i)]});
    }
  });
  std::ranges::sort(bins, {}, &Bin::place);
  EvaluatedBelief evaluated;
  for (const Bin& bin : bins) {
    evaluated.index.push_back(bin.place);
    evaluated.log_likelihood.push_back(bin.log_likelihood);
  }
  const double rest = std::exp(off_map.log() - found.all().evaluated) + found.unproven();
  evaluated.rest_mass_bound = rest < 1.0 ? rest : 1.0;
  return evaluated;
}

double BoundedPosterior::log_likelihood(int object, const Pose& T_object_robot) const {
  const BoundedBelief& belief = with_touches_taken_in();
  require_object(object, belief.hypotheses().size());
  const std::int64_t bin = lattice().bin_of(T_object_robot);  // refuses a pose that is not finite
  const KnownElements& elements = belief.elements();
  if (!belief.options().touch_sd.none()) {
    const auto row = static_cast<std::int32_t>(bin / lattice().x_mm.count);
    const BinBox box{.object = object,
                     .theta = row / lattice().y_mm.count,
                     .y_first = row % lattice().y_mm.count,
                     .y_count = 1,
                     .x_first = static_cast<std::int32_t>(bin % lattice().x_mm.count),
                     .x_count = 1};
    return belief.log_likelihood(std::span(&box, 1), belief.likelihood()).front();
  }
  const MapLikelihood likelihood(belief.hypotheses()[object].compared(), belief.options().contact,
                                 static_cast<std::size_t>(object));
  double sum = 0.0;
  for (const ReadingRun& run : elements.runs) {
    likelihood.require(run.reading);
    for (std::size_t e = run.begin; e < run.end; ++e) {
      const glm::dvec2 p_mm =
          T_object_robot * (elements.from_pivot_mm[e] + belief.options().lattice.pivot_mm);
      sum += likelihood.at(run.reading, p_mm);
    }
  }
  return sum;
}

double BoundedPosterior::entropy() const { return with_touches_taken_in().bins().entropy(); }

std::vector<PoseSample> BoundedPosterior::sample(std::size_t count, std::uint64_t seed) const {
  return with_touches_taken_in().bins().sample(count, seed);
}

std::vector<TouchGain> BoundedPosterior::expected_gain(std::span<const Pose> T_robot_sensor,
                                                       std::span<const glm::dvec2> elements_mm,
                                                       const PlanOptions& plan) const {
  Impl& belief = with_touches_taken_in();
  require_plan(T_robot_sensor, elements_mm, plan, belief.hypotheses().size());
  if (!belief.predicted) {
    belief.predicted.emplace(belief.hypotheses(), belief.options().contact);
  }
  const std::vector<PoseSample> samples = belief.bins().sample(plan.samples, plan.seed);
  return palpate::expected_gain(*belief.predicted, samples, T_robot_sensor, elements_mm,
                                belief.options().touch_sd, plan);
}

std::vector<PoseBlock> BoundedPosterior::refined_blocks() const {
  return with_touches_taken_in().refined_blocks();
}

const PoseLattice& BoundedPosterior::lattice() const { return impl().options().lattice; }

std::string BoundedPosterior::path() const { return impl().path(); }

std::uint64_t BoundedPosterior::host_bytes() const { return impl().bytes(); }

}  // namespace palpate
