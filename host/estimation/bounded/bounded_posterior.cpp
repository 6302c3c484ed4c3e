#include "palpate/bounded_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include "estimation/bounded/bounded_belief.hpp"
#include "estimation/bounded/checked_options.hpp"
#include "estimation/bounded/marginal_sums.hpp"
#include "estimation/bounded/search_memory.hpp"
#include "estimation/hypotheses.hpp"
#include "estimation/lattice/expected_gain.hpp"
#include "estimation/lattice/refinement.hpp"
#include "estimation/log_sum.hpp"
#include "model/map_likelihood.hpp"
#include "model/own_process.hpp"
#include "palpate/error.hpp"

namespace palpate {

struct BoundedPosterior::Impl {
  Impl(std::span<const Hypothesis> hypotheses, const BoundedOptions& options)
      : belief(hypotheses, options) {
    for (const Hypothesis& hypothesis : hypotheses) {
      bodies.push_back(displaced_body(hypothesis.map));
    }
  }

  BoundedBelief belief;
  std::optional<PredictedReadings> predicted;  ///< once a gain is asked for
  std::vector<Body> bodies;                    ///< [hypothesis]
  OwnProcess process;
};

BoundedPosterior::BoundedPosterior(std::span<const Hypothesis> hypotheses,
                                   const BoundedOptions& options)
    : impl_(std::make_unique<Impl>(hypotheses, checked(options, hypotheses))) {}

BoundedPosterior::~BoundedPosterior() { replace_held(impl_); }
BoundedPosterior::BoundedPosterior(BoundedPosterior&&) noexcept = default;
BoundedPosterior& BoundedPosterior::operator=(BoundedPosterior&& other) noexcept {
  replace_held(impl_, std::move(other.impl_));
  return *this;
}

BoundedPosterior::Impl& BoundedPosterior::impl() const {
  return held_here(impl_, "bounded posterior");
}

BoundedPosterior::Impl& BoundedPosterior::with_touches_taken_in() const {
  Impl& held = impl();
  held.belief.take_in();
  return held;
}

void BoundedPosterior::reset() { impl().belief.reset(); }

void BoundedPosterior::move_pivot(const glm::dvec2& pivot_mm) {
  with_touches_taken_in().belief.move_pivot(pivot_mm);
}

void BoundedPosterior::update(std::span<const Touch> touches,
                              const std::function<void(double)>& progress) {
  BoundedBelief& belief = impl().belief;
  if (progress) {
    progress(1.0);
  }
  belief.kept().add(touches, belief.touches().options().contact);
}

void BoundedPosterior::update(std::span<const TouchEvidence> touches,
                              const std::function<void(double)>& progress) {
  BoundedBelief& belief = impl().belief;
  if (progress) {
    progress(1.0);
  }
  belief.kept().add(touches);
}

Estimate BoundedPosterior::estimate(std::optional<double> tolerance) const {
  BoundedBelief& belief = with_touches_taken_in().belief;
  if (tolerance) {
    require_tolerance(*tolerance);
  }
  const SearchResult& found =
      belief.found(tolerance.value_or(belief.touches().options().tolerance));
  Estimate estimate;
  std::vector<double> logs;
  std::vector<LogInterval> bounds;
  for (const HypothesisMass& mass : found.mass) {
    logs.push_back(mass.evaluated);
    bounds.push_back(mass.bounds());
  }
  // Dropped and rounding mass over the whole that they are part of.
  const double dropped = found.unproven();
  Certificate certificate{.dropped_mass = std::isfinite(dropped) ? dropped / (1.0 + dropped) : 1.0,
                          .log_evidence = bounds,
                          .mode_certain = found.mode_certain,
                          .blocks_bounded = found.blocks_bounded,
                          .bins_evaluated = found.bins_evaluated};
  const LogInterval none = belief.none_log_evidence();
  if (belief.touches().has_none()) {
    logs.push_back(belief.none_estimate());
    certificate.none_log_evidence = none;
  }
  estimate.identity = normalised(logs);
  if (belief.touches().has_none()) {
    estimate.none = estimate.identity.back();
    estimate.identity.pop_back();
    estimate.none_log_evidence = belief.none_estimate();
    logs.pop_back();
  }
  estimate.log_evidence = std::move(logs);
  // Where nothing is known, an interval ends at 0 or 1.
  const auto probability = [](double own, double others) {
    const double p = 1.0 / (1.0 + std::exp(others - own));
    return std::isnan(p) ? std::optional<double>() : p;
  };
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
    const double p = estimate.identity[i];
    estimate.identity_bounds.push_back(
        {std::min(p, probability(bounds[i].low, others_high.log()).value_or(0.0)),
         std::max(p, probability(bounds[i].high, others_low.log()).value_or(1.0))});
  }
  estimate.certificate = std::move(certificate);
  estimate.mode = {.object = found.best_object,
                   .bin = found.best_bin,
                   .T_object_robot = lattice().T_object_robot(found.best_bin),
                   .log_likelihood = found.best_log_likelihood};
  estimate.contradicted = found.contradicted;
  return estimate;
}

RefinedPose BoundedPosterior::refine(const Mode& mode) const {
  Impl& posterior = with_touches_taken_in();
  require_object(mode.object, posterior.bodies.size());
  BoundedBelief& belief = posterior.belief;
  // Where bins are very fine, a few of them tell the peak, and all would take long. A mean over
  // displacements takes the others all the same.
  const PoseLattice fit =
      belief.touches().options().touch_sd.none() ? thinned(lattice()) : lattice();
  const bool thin = fit.plane() != lattice().plane();
  std::optional<BinLikelihood> of_thin;
  Mode start = mode;
  if (thin) {
    of_thin.emplace(belief.touches().hypotheses(), belief.touches().options().contact, fit);
    if (mode.bin && *mode.bin >= 0 && *mode.bin < lattice().bins()) {
      start.bin = fit.bin_of(lattice().T_object_robot(*mode.bin));
    }
  }
  const auto log_likelihood = [&](std::span<const BinBox> boxes) {
    if (!thin) {
      return belief.log_likelihood(boxes);
    }
    std::size_t bins = 0;
    for (const BinBox& box : boxes) {
      bins += static_cast<std::size_t>(box.bins());
    }
    std::vector<double> logs(bins);
    belief.touches().on_threads(
        [&] { of_thin->evaluate(boxes, belief.touches().elements(), logs); });
    return logs;
  };
  return palpate::refine(log_likelihood, fit, posterior.bodies[mode.object], start);
}

Marginals BoundedPosterior::marginals(int object) const { return marginals(object, lattice()); }

Marginals BoundedPosterior::marginals(int object, const PoseLattice& grid) const {
  Impl& posterior = with_touches_taken_in();
  require_object(object, posterior.bodies.size());
  PoseLattice onto = grid;
  onto.collapse_fixed().validate();
  BoundedBelief& belief = posterior.belief;
  belief.found();
  const double log_total =
      log_add(belief.log_total(), belief.none_estimate()) - belief.touches().log_weight()[object];
  MarginalSums sums(lattice(), onto);
  belief.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    if (box.object == object) {
      sums.add(box, log_likelihood, -log_total);
    }
  });
  return sums.take();
}

std::vector<std::vector<BinShare>> BoundedPosterior::likely_bins(std::span<const int> objects,
                                                                 double least_share) const {
  Impl& posterior = with_touches_taken_in();
  for (const int object : objects) {
    require_object(object, posterior.bodies.size());
  }
  BoundedBelief& belief = posterior.belief;
  const SearchResult& found = belief.found();
  std::vector<std::vector<BinShare>> likely(posterior.bodies.size());
  std::vector<std::uint8_t> asked(likely.size());
  for (const int object : objects) {
    asked[object] = 1;
  }
  belief.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    if (asked[box.object] == 0) {
      return;
    }
    const double log_total =
        found.mass[box.object].evaluated - belief.touches().log_weight()[box.object];
    const double least = log_total + std::log(least_share);
    const auto all_alike = log_likelihood.size() == 1;
    if (all_alike && log_likelihood[0] < least) {
      return;
    }
    for (std::int64_t i = 0; i < box.bins(); ++i) {
      const double log_share = log_likelihood[all_alike ? 0 : static_cast<std::size_t>(i)];
      if (log_share >= least) {
        likely[box.object].push_back({box.bin(i, lattice()), std::exp(log_share - log_total)});
      }
    }
  });
  std::vector<std::vector<BinShare>> of_objects;
  for (const int object : objects) {
    of_objects.push_back(likely[object]);
  }
  return of_objects;
}

EvaluatedBelief BoundedPosterior::evaluated_bins() const {
  BoundedBelief& belief = with_touches_taken_in().belief;
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
      off_map.add(belief.touches().log_weight()[box.object] + log_likelihood[0] +
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
  const double rest = std::exp(off_map.log() - belief.log_total()) + found.unproven();
  evaluated.rest_mass_bound = rest < 1.0 ? rest : 1.0;
  return evaluated;
}

double BoundedPosterior::log_likelihood(int object, const Pose& T_object_robot) const {
  Impl& posterior = with_touches_taken_in();
  require_object(object, posterior.bodies.size());
  const auto& [translation_mm, theta_rad] = T_object_robot;
  if (!std::isfinite(translation_mm.x) || !std::isfinite(translation_mm.y) ||
      !std::isfinite(theta_rad)) {
    throw Error(Fault::input, fmt::format("pose {}, {}, {}: give finite numbers", translation_mm.x,
                                          translation_mm.y, theta_rad));
  }
  BoundedBelief& belief = posterior.belief;
  const KnownElements& elements = belief.touches().elements();
  if (!belief.touches().options().touch_sd.none()) {
    const std::int64_t bin = lattice().bin_of(T_object_robot);
    const auto row = static_cast<std::int32_t>(bin / lattice().x_mm.count);
    const BinBox box{.object = object,
                     .theta = row / lattice().y_mm.count,
                     .y_first = row % lattice().y_mm.count,
                     .y_count = 1,
                     .x_first = static_cast<std::int32_t>(bin % lattice().x_mm.count),
                     .x_count = 1};
    return belief.log_likelihood(std::span(&box, 1)).front();
  }
  const MapLikelihood likelihood(belief.touches().hypotheses()[object].compared(),
                                 belief.touches().options().contact,
                                 static_cast<std::size_t>(object));
  double sum = 0.0;
  for (const ReadingRun& run : elements.runs) {
    for (std::size_t e = run.begin; e < run.end; ++e) {
      const glm::dvec2 p_mm = T_object_robot * (elements.from_pivot_mm[e] +
                                                belief.touches().options().lattice.pivot_mm);
      sum += likelihood.at(run.reading, p_mm);
    }
  }
  return sum;
}

double BoundedPosterior::entropy() const {
  BoundedBelief& belief = with_touches_taken_in().belief;
  belief.found();
  const double log_total = belief.log_total();
  double entropy = 0.0;
  belief.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    const double times = log_likelihood.size() == 1 ? static_cast<double>(box.bins()) : 1.0;
    for (const double l : log_likelihood) {
      const double log_p = belief.touches().log_weight()[box.object] + l - log_total;
      entropy -= times * std::exp(log_p) * log_p;
    }
  });
  return entropy;
}

std::vector<PoseSample> BoundedPosterior::sample(std::size_t count, std::uint64_t seed) const {
  return with_touches_taken_in().belief.sample(count, seed);
}

std::vector<TouchGain> BoundedPosterior::expected_gain(std::span<const Pose> T_robot_sensor,
                                                       std::span<const glm::dvec2> elements_mm,
                                                       const PlanOptions& plan) const {
  Impl& posterior = with_touches_taken_in();
  BoundedBelief& belief = posterior.belief;
  require_plan(T_robot_sensor, elements_mm, plan, posterior.bodies.size());
  if (!posterior.predicted) {
    posterior.predicted.emplace(belief.touches().hypotheses(), belief.touches().options().contact);
  }
  const std::vector<PoseSample> samples = belief.sample(plan.samples, plan.seed);
  return palpate::expected_gain(*posterior.predicted, samples, T_robot_sensor, elements_mm,
                                belief.touches().options().touch_sd, plan);
}

std::vector<PoseBlock> BoundedPosterior::refined_blocks() const {
  return with_touches_taken_in().belief.refined_blocks();
}

const PoseLattice& BoundedPosterior::lattice() const {
  return impl().belief.touches().options().lattice;
}

std::string BoundedPosterior::path() const { return impl().belief.touches().path(); }

std::uint64_t BoundedPosterior::host_bytes() const { return impl().belief.bytes(); }

}  // namespace palpate
