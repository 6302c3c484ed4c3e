#include "palpate/bounded_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "belief_draws.hpp"
#include "bin_likelihood.hpp"
#include "bound_search.hpp"
#include "evaluated_bins.hpp"
#include "faster_bin_likelihood.hpp"
#include "followed_bins.hpp"
#include "half_done.hpp"
#include "hypotheses.hpp"
#include "interpolated_map.hpp"
#include "known_elements.hpp"
#include "log_sum.hpp"
#include "marginal_sums.hpp"
#include "moved_from.hpp"
#include "moved_pivot.hpp"
#include "palpate/error.hpp"
#include "refinement.hpp"
#include "sampled_touch_mean.hpp"
#include "search_memory.hpp"

namespace palpate {

namespace {

/// Tolerance that a search with a budget reaches before it goes on, and enough to draw samples.
constexpr double soon = 1e-2;
/// Bins of all hypotheses together up to which samples are drawn at the full tolerance.
constexpr double closely_drawn_bins = 1e6;

/// The lattice with every few bins along x and y where they are much finer than a pose's fit needs.
/// Its centres are centres of the lattice.
PoseLattice thinned(PoseLattice lattice) {
  constexpr double fine_mm = 0.1;
  for (Axis* axis : {&lattice.x_mm, &lattice.y_mm}) {
    const double step = axis->step();
    if (axis->count > 1 && 3.0 * step <= fine_mm) {
      // An odd number, so that the middle one is a centre.
      const int every = static_cast<int>((fine_mm / step - 1.0) / 2.0) * 2 + 1;
      axis->count = std::max(1, axis->count / every);
      axis->upper = axis->lower + axis->count * every * step;
    }
  }
  return lattice;
}

/// @throws Error on an option out of range
void validate(const BoundedOptions& options) {
  const auto refuse = [](const char* field, double value, const char* remedy) {
    throw Error(Fault::input, fmt::format("{} = {}: give {}", field, value, remedy));
  };
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  if (!(options.tolerance > 0.0 && options.tolerance < 1.0)) {
    refuse("tolerance", options.tolerance, "a share of the mass between 0 and 1, such as 1e-6");
  }
  if (options.budget_s && !positive(*options.budget_s)) {
    refuse("budget_s", *options.budget_s, "a positive number of seconds, or none");
  }
  if (options.evidence_nats && !positive(*options.evidence_nats)) {
    refuse("evidence_nats", *options.evidence_nats, "a positive number of nats, or none");
  }
  if (options.none_weight && !positive(*options.none_weight)) {
    refuse("none_weight", *options.none_weight, "a positive number, or none");
  }
  if (options.threads < 0) {
    refuse("threads", options.threads, "at least 1, or 0 for all cores");
  }
}

}  // namespace

struct BoundedPosterior::Impl {
  Impl(Device& device, std::span<const Hypothesis> all, const BoundedOptions& wanted)
      : options(wanted),
        hypotheses(all.begin(), all.end()),
        // More threads than cores gain nothing.
        threads(options.threads > 0 ? std::min(options.threads, tbb::info::default_concurrency())
                                    : tbb::info::default_concurrency()),
        arena(threads),
        likelihood(all, options.contact, options.lattice),
        batches(likelihood, device.context(), hypotheses, options.contact, options.lattice,
                options.on_host ? BinPlace::host : BinPlace::measured),
        search(arena.execute([&] { return BoundSearch(all, options, likelihood, batches); })),
        log_weight(log_weights(all)) {
    for (const Hypothesis& hypothesis : all) {
      bodies.push_back(displaced_body(hypothesis.map));
    }
    if (options.none_weight) {
      none.emplace(all, options.contact, options.lattice, log_weight, likelihood, search.bounds());
      none_log_weight = std::log(*options.none_weight) - log_total_weight(all) +
                        std::log(static_cast<double>(options.lattice.bins()));
    }
  }

  /// Log evidence of "none of these" with its prior weight, as SearchResult::evidence has that of
  /// the hypotheses; -infinity where it is left out.
  double none_log_evidence() const {
    return none ? none_log_weight + none->log_evidence() : -std::numeric_limits<double>::infinity();
  }

  Deadline until(const std::optional<double>& budget_s) const {
    return Deadline(budget_s, &options.cancel_point);
  }

  const SearchResult& found() {
    if (!result || rough) {
      result.reset();
      rough = false;
      Deadline deadline = until(options.budget_s);
      SearchGoal goal{options.tolerance, options.evidence_nats, options.evidence_range_nats};
      if (deadline.exists()) {
        // What is proven soon comes first: a search that is cut short proves little.
        goal.tolerance = std::max(goal.tolerance, soon);
      }
      SearchResult best = run(goal, deadline, bins);
      if (goal.tolerance > options.tolerance && !deadline.passed()) {
        goal.tolerance = options.tolerance;
        EvaluatedBins more(true);
        SearchResult better = run(goal, deadline, more);
        if (better.uncertain() < best.uncertain()) {
          best = std::move(better);
          bins = std::move(more);
        }
      }
      result = std::move(best);
    }
    return *result;
  }

  /// Sees to it that there is a last search's result, of a quick search if need be: enough to draw
  /// samples from.
  void find_roughly() {
    if (!result) {
      Deadline deadline = until(options.budget_s);
      result = run(rough_goal(), deadline, bins);
      rough = true;
    }
  }

  /// What a search for samples is to reach. Few bins take as long whatever the tolerance, and a
  /// close one lets those that are found be followed through the next touches.
  SearchGoal rough_goal() const {
    const double all =
        static_cast<double>(options.lattice.bins()) * static_cast<double>(hypotheses.size());
    return {all <= closely_drawn_bins ? options.tolerance : std::max(options.tolerance, soon), {}};
  }

  /// The touches are to be added: keeps what the last search found of the belief before them.
  void follow(std::span<const ArrayReadings> touches) {
    if (result && bins.complete() && bins.values() <= FollowedBins::most_bins) {
      followed.emplace(bins, *result, log_weight);
      not_followed.clear();
    }
    if (followed) {
      for (const ArrayReadings& touch : touches) {
        not_followed.push_back(known_elements(touch));
      }
    }
    result.reset();
  }

  /// The followed bins after all touches; nullptr where they may not hold enough to draw samples.
  const FollowedBins* followed_bins() {
    if (result || !followed) {
      return nullptr;
    }
    for (const KnownElements& touch : std::exchange(not_followed, {})) {
      std::vector<double> most;
      for (const TileBounds& bounds : search.bounds()) {
        most.push_back(bounds.best(bounds.levels().size() - 1, touch));
      }
      followed->add(touch, likelihood, most);
    }
    if (!(followed->share_outside() <= soon)) {
      followed.reset();
      return nullptr;
    }
    return &*followed;
  }

  SearchResult run(const SearchGoal& goal, Deadline& deadline, EvaluatedBins& evaluated) {
    evaluated.clear();
    return arena.execute([&] {
      return search.run(elements, goal, deadline,
                        [&](const BinBox& box, std::span<const double> log_likelihood) {
                          evaluated.add(box, log_likelihood);
                          if (evaluated.full()) {
                            // With a budget, bins are evaluated as long as there is room for them:
                            // another search could not evaluate the same.
                            deadline.end();
                          }
                        });
    });
  }

  /// Visits the bins that the last search evaluated; searches again where there was no room to keep
  /// them.
  void visit(const BinVisitor& visitor) {
    if (bins.complete()) {
      bins.visit(visitor);
    } else {
      SearchGoal goal{options.tolerance, options.evidence_nats, options.evidence_range_nats};
      if (rough) {
        goal = rough_goal();
      }
      arena.execute([&] { search.run(elements, goal, until({}), visitor); });
    }
  }

  /// Log of the summed likelihood of all bins that the last search evaluated, with prior weights.
  double log_total() const {
    LogSum total;
    for (const HypothesisEvidence& evidence : result->evidence) {
      total.add(evidence.evaluated);
    }
    return total.log();
  }

  void require_object(int object) const {
    if (object < 0 || static_cast<std::size_t>(object) >= hypotheses.size()) {
      throw Error(Fault::input, fmt::format("object {}: there are {}, counted from 0", object,
                                            hypotheses.size()));
    }
  }

  BoundedOptions options;
  std::vector<Hypothesis> hypotheses;
  int threads;
  tbb::task_arena arena;
  BinLikelihood likelihood;
  FasterBinLikelihood batches;
  BoundSearch search;
  std::vector<double> log_weight;
  std::vector<Body> bodies;
  KnownElements elements;
  bool touched = false;
  std::optional<SearchResult> result;
  bool rough = false;  ///< result is find_roughly()'s
  EvaluatedBins bins{options.budget_s.has_value()};
  std::optional<FollowedBins> followed;
  std::vector<KnownElements> not_followed;  ///< touches that `followed` has not yet taken in
  std::optional<SampledTouchMeans> none;    ///< where the options ask for it
  double none_log_weight = 0.0;             ///< log of its prior weight times the number of bins
  HalfDone half_done{"bounded posterior: an update was broken off half-way; call reset()"};
};

BoundedPosterior::BoundedPosterior(Device& device, std::span<const Hypothesis> hypotheses,
                                   const BoundedOptions& options) {
  validate_hypotheses(hypotheses);
  validate(options);
  BoundedOptions checked = options;
  checked.lattice.collapse_fixed().validate();
  checked.contact = resolve(options.contact, hypotheses);
  if (checked.none_weight && !checked.contact.table && checked.contact.gamma == 0.0) {
    throw Error(Fault::input,
                "none_weight: with gamma = 0 the mean likelihood is that of a few bins, which a "
                "sample misses; use a gamma above 0, or PoseHistogram");
  }
  require_room(hypotheses, checked, memory_for_search());
  impl_ = std::make_unique<Impl>(device, hypotheses, checked);
}

BoundedPosterior::~BoundedPosterior() = default;
BoundedPosterior::BoundedPosterior(BoundedPosterior&&) noexcept = default;
BoundedPosterior& BoundedPosterior::operator=(BoundedPosterior&&) noexcept = default;

BoundedPosterior::Impl& BoundedPosterior::impl() const {
  return held_by(impl_, "bounded posterior");
}

BoundedPosterior::Impl& BoundedPosterior::whole() const {
  Impl& held = impl();
  held.half_done.refuse();
  return held;
}

void BoundedPosterior::reset() {
  Impl& posterior = impl();
  posterior.half_done.forget();
  posterior.elements = {};
  posterior.touched = false;
  posterior.search.reset();
  posterior.result.reset();
  posterior.followed.reset();
  if (posterior.none) {
    posterior.none->reset();
  }
}

void BoundedPosterior::move_pivot(const glm::dvec2& pivot_mm) {
  Impl& posterior = whole();
  posterior.options.lattice =
      with_pivot(posterior.options.lattice, pivot_mm, "bounded posterior", posterior.touched);
  posterior.likelihood.move_pivot(pivot_mm);
  posterior.batches.move_pivot(pivot_mm);
  if (posterior.none) {
    posterior.none->move_pivot(pivot_mm);
  }
  posterior.result.reset();
  posterior.followed.reset();
}

void BoundedPosterior::update(std::span<const Touch> touches,
                              const std::function<void(double)>& progress) {
  Impl& posterior = whole();
  // All touches are gathered before the first is added: one that is not sound refuses all.
  std::vector<ArrayReadings> of_touches;
  for (const Touch& touch : touches) {
    of_touches.push_back(
        array_readings(touch, posterior.options.contact, posterior.options.lattice.pivot_mm));
  }
  std::vector<TouchMean> means;
  if (posterior.none) {
    posterior.arena.execute([&] {
      means = posterior.none->evaluate(touches, [&](std::size_t done) {
        if (progress) {
          progress(static_cast<double>(done) / (static_cast<double>(touches.size()) + 1.0));
        }
      });
    });
  }
  if (progress) {
    progress(1.0);
  }
  posterior.half_done.change([&] {
    posterior.follow(of_touches);
    posterior.touched = posterior.touched || !touches.empty();
    std::vector<KnownElements> all;
    for (const ArrayReadings& touch : of_touches) {
      all.push_back(known_elements(touch));
    }
    all.push_back(std::move(posterior.elements));
    posterior.elements = merged(all);
    if (posterior.none) {
      posterior.none->add(means);
    }
    posterior.arena.execute([&] { posterior.search.add(of_touches); });
  });
}

Estimate BoundedPosterior::estimate() const {
  Impl& posterior = whole();
  const SearchResult& found = posterior.found();
  Estimate estimate;
  LogSum evaluated;
  LogSum uncertain;
  std::vector<double> logs;
  std::vector<LogInterval> bounds;
  LogSum all_low;
  LogSum all_high;
  for (const HypothesisEvidence& evidence : found.evidence) {
    logs.push_back(evidence.evaluated);
    evaluated.add(evidence.evaluated);
    uncertain.add(evidence.rounding);
    uncertain.add(evidence.dropped);
    bounds.push_back({log_subtract(evidence.evaluated, evidence.rounding),
                      log_add(log_add(evidence.evaluated, evidence.rounding), evidence.dropped)});
  }
  // Dropped and rounding mass over the whole that they are part of.
  const double dropped = std::exp(uncertain.log() - evaluated.log());
  Certificate certificate{.dropped_mass = std::isfinite(dropped) ? dropped / (1.0 + dropped) : 1.0,
                          .log_evidence = bounds,
                          .mode_certain = found.mode_certain,
                          .blocks_bounded = found.blocks_bounded,
                          .bins_evaluated = found.bins_evaluated};
  const double none = posterior.none_log_evidence();
  if (posterior.none) {
    logs.push_back(none);
    certificate.none_log_evidence = none;
    certificate.none_standard_error = posterior.none->standard_error();
  }
  estimate.identity = normalised(logs);
  if (posterior.none) {
    estimate.none = estimate.identity.back();
    estimate.identity.pop_back();
    estimate.none_log_evidence = none;
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
    others_low.add(none);
    others_high.add(none);
    for (std::size_t other = 0; other < bounds.size(); ++other) {
      if (other != i) {
        others_low.add(bounds[other].low);
        others_high.add(bounds[other].high);
      }
    }
    estimate.identity_bounds.push_back(
        {probability(bounds[i].low, others_high.log()).value_or(0.0),
         probability(bounds[i].high, others_low.log()).value_or(1.0)});
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
  Impl& posterior = whole();
  posterior.require_object(mode.object);
  // Of very fine bins every few are enough, and all would take long.
  const PoseLattice fit = thinned(lattice());
  const bool thin = fit.plane() != lattice().plane();
  std::optional<BinLikelihood> of_thin;
  Mode start = mode;
  if (thin) {
    of_thin.emplace(posterior.hypotheses, posterior.options.contact, fit);
    if (mode.bin && *mode.bin >= 0 && *mode.bin < lattice().bins()) {
      start.bin = fit.bin_of(lattice().T_object_robot(*mode.bin));
    }
  }
  const BinLikelihood& likelihood = thin ? *of_thin : posterior.likelihood;
  const auto log_likelihood = [&](const BinWindow& window) {
    const int thetas = fit.theta_rad.count;
    const std::size_t plane = static_cast<std::size_t>(window.row_count) * window.column_count;
    std::vector<float> logs(window.bins());
    posterior.arena.execute([&] {
      tbb::parallel_for(0, window.theta_count, [&](int t) {
        const BinBox box{mode.object,         ((window.theta_first + t) % thetas + thetas) % thetas,
                         window.row_first,    window.row_count,
                         window.column_first, window.column_count};
        likelihood.evaluate(std::span(&box, 1), posterior.elements,
                            std::span(logs).subspan(static_cast<std::size_t>(t) * plane, plane));
      });
    });
    return std::vector<double>(logs.begin(), logs.end());
  };
  return palpate::refine(log_likelihood, fit, posterior.bodies[mode.object], start);
}

Marginals BoundedPosterior::marginals(int object) const { return marginals(object, lattice()); }

Marginals BoundedPosterior::marginals(int object, const PoseLattice& grid) const {
  Impl& posterior = whole();
  posterior.require_object(object);
  PoseLattice onto = grid;
  onto.collapse_fixed().validate();
  posterior.found();
  const double log_total =
      log_add(posterior.log_total(), posterior.none_log_evidence()) - posterior.log_weight[object];
  MarginalSums sums(lattice(), onto);
  posterior.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    if (box.object == object) {
      sums.add(box, log_likelihood, -log_total);
    }
  });
  return sums.take();
}

double BoundedPosterior::log_likelihood(int object, const Pose& T_object_robot) const {
  Impl& posterior = whole();
  posterior.require_object(object);
  const auto& [translation_mm, theta_rad] = T_object_robot;
  if (!std::isfinite(translation_mm.x) || !std::isfinite(translation_mm.y) ||
      !std::isfinite(theta_rad)) {
    throw Error(Fault::input, fmt::format("pose {}, {}, {}: give finite numbers", translation_mm.x,
                                          translation_mm.y, theta_rad));
  }
  const ContactModel& contact = posterior.options.contact;
  const InterpolatedMap map(posterior.hypotheses[object].compared(), *contact.prior);
  double sum = 0.0;
  for (const ReadingRun& run : posterior.elements.runs) {
    for (std::size_t e = run.begin; e < run.end; ++e) {
      const glm::dvec2 p_mm = T_object_robot * (posterior.elements.from_pivot_mm[e] +
                                                posterior.options.lattice.pivot_mm);
      sum += contact.log_likelihood(run.reading, {map.log_odds(p_mm)},
                                    static_cast<std::size_t>(object));
    }
  }
  return sum;
}

double BoundedPosterior::entropy() const {
  Impl& posterior = whole();
  posterior.found();
  const double log_total = posterior.log_total();
  double entropy = 0.0;
  posterior.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    const double times = log_likelihood.size() == 1 ? static_cast<double>(box.bins()) : 1.0;
    for (const double l : log_likelihood) {
      const double log_p = posterior.log_weight[box.object] + l - log_total;
      entropy -= times * std::exp(log_p) * log_p;
    }
  });
  return entropy;
}

std::vector<PoseSample> BoundedPosterior::sample(std::size_t count, std::uint64_t seed) const {
  Impl& posterior = whole();
  const FollowedBins* followed = posterior.followed_bins();
  if (followed == nullptr) {
    posterior.find_roughly();
  }
  BeliefDraws draws(count, seed, lattice(), posterior.log_weight,
                    followed != nullptr ? followed->log_total() : posterior.log_total());
  const auto add = [&](const BinBox& box, std::span<const double> log_likelihood) {
    draws.add(box, log_likelihood);
  };
  if (followed != nullptr) {
    followed->visit(add);
  } else {
    posterior.visit(add);
  }
  return draws.take();
}

std::vector<PoseBlock> BoundedPosterior::refined_blocks() const {
  Impl& posterior = whole();
  std::vector<PoseBlock> blocks;
  posterior.arena.execute([&] {
    std::vector<PoseBlock> evaluated;
    const auto note = [&](const BinBox& box, std::span<const double> log_likelihoods) {
      if (static_cast<std::int64_t>(log_likelihoods.size()) == box.bins()) {
        evaluated.push_back({.object = box.object,
                             .level = posterior.search.finest_level(),
                             .theta = box.theta,
                             .x_first = box.x_first,
                             .x_count = box.x_count,
                             .y_first = box.y_first,
                             .y_count = box.y_count});
      }
    };
    posterior.search.run(posterior.elements,
                         {posterior.options.tolerance, posterior.options.evidence_nats,
                          posterior.options.evidence_range_nats},
                         posterior.until({}), note, &blocks);
    blocks.insert(blocks.end(), evaluated.begin(), evaluated.end());
  });
  return blocks;
}

const PoseLattice& BoundedPosterior::lattice() const { return impl().options.lattice; }

std::string BoundedPosterior::path() const {
  const Impl& posterior = impl();
  return fmt::format("{} on {} thread{}, {}", posterior.likelihood.instructions(),
                     posterior.threads, posterior.threads == 1 ? "" : "s",
                     posterior.batches.path());
}

std::uint64_t BoundedPosterior::host_bytes() const {
  const Impl& posterior = impl();
  return posterior.likelihood.bytes() + posterior.search.bytes() + posterior.bins.bytes();
}

}  // namespace palpate
