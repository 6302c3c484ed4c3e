#include "palpate/bounded_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "bin_likelihood.hpp"
#include "bound_search.hpp"
#include "contradiction.hpp"
#include "hypotheses.hpp"
#include "interpolated_map.hpp"
#include "known_elements.hpp"
#include "moved_from.hpp"
#include "moved_pivot.hpp"
#include "palpate/error.hpp"
#include "random.hpp"
#include "refinement.hpp"
#include "sampled_touch_mean.hpp"

namespace palpate {

struct BoundedPosterior::Impl {
  Impl(std::span<const Hypothesis> all, const BoundedOptions& wanted)
      : options(wanted),
        hypotheses(all.begin(), all.end()),
        likelihood(all, options.contact, options.lattice),
        log_weight(log_weights(all)) {
    for (const Hypothesis& hypothesis : all) {
      bodies.push_back(displaced_body(hypothesis.map));
    }
    if (options.none_weight) {
      none.emplace(all, options.contact, options.lattice, log_weight, likelihood);
      none_log_weight = std::log(*options.none_weight) - log_total_weight(all) +
                        std::log(static_cast<double>(options.lattice.bins()));
    }
  }

  /// Log evidence of "none of these" with its prior weight, as SearchResult::evidence has that of
  /// the hypotheses.
  std::optional<double> none_log_evidence() const {
    return none ? std::optional(none_log_weight + none->log_evidence()) : std::nullopt;
  }

  const SearchResult& search() {
    if (!found) {
      SearchResult result;
      const PoseLattice& in = options.lattice;
      double best = -std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < hypotheses.size(); ++i) {
        for (int t = 0; t < in.theta_rad.count; ++t) {
          result.bins.boxes.push_back({static_cast<int>(i), t, 0, in.y_mm.count, 0, in.x_mm.count});
        }
      }
      result.bins.log_likelihood.resize(hypotheses.size() * in.bins());
      likelihood.evaluate(result.bins.boxes, elements, std::span(result.bins.log_likelihood));
      for (std::size_t i = 0; i < hypotheses.size(); ++i) {
        const auto logs = std::span(result.bins.log_likelihood).subspan(i * in.bins(), in.bins());
        const auto at = std::max_element(logs.begin(), logs.end());
        double sum = 0.0;
        for (const double l : logs) {
          sum += std::exp(l - *at);
        }
        result.evidence.push_back({log_weight[i] + *at + std::log(sum), -1e9, -1e9});
        if (log_weight[i] + *at > best) {
          best = log_weight[i] + *at;
          result.best_object = static_cast<int>(i);
          result.best_bin = at - logs.begin();
          result.best_log_likelihood = *at;
        }
      }
      result.mode_certain = true;
      result.bins_evaluated = static_cast<std::int64_t>(result.bins.log_likelihood.size());
      found = std::move(result);
    }
    return *found;
  }

  void require_object(int object) const {
    if (object < 0 || static_cast<std::size_t>(object) >= hypotheses.size()) {
      throw Error(Fault::input, fmt::format("object {}: there are {}, counted from 0", object,
                                            hypotheses.size()));
    }
  }

  BoundedOptions options;
  std::vector<Hypothesis> hypotheses;
  BinLikelihood likelihood;
  std::vector<double> log_weight;
  std::vector<Body> bodies;
  KnownElements elements;
  bool touched = false;
  double prior_log_likelihood = 0.0;  ///< of all touches, by a map that holds only the prior
  std::optional<SearchResult> found;
  std::optional<SampledTouchMeans> none;  ///< where the options ask for it
  double none_log_weight = 0.0;           ///< log of its prior weight times the number of bins
};

namespace {

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

BoundedPosterior::BoundedPosterior(Device& /*device*/, std::span<const Hypothesis> hypotheses,
                                   const BoundedOptions& options) {
  validate_hypotheses(hypotheses);
  validate(options);
  BoundedOptions checked = options;
  checked.lattice.collapse_fixed().validate();
  checked.contact = resolve(options.contact, hypotheses);
  impl_ = std::make_unique<Impl>(hypotheses, checked);
}

BoundedPosterior::~BoundedPosterior() = default;
BoundedPosterior::BoundedPosterior(BoundedPosterior&&) noexcept = default;
BoundedPosterior& BoundedPosterior::operator=(BoundedPosterior&&) noexcept = default;

BoundedPosterior::Impl& BoundedPosterior::impl() const {
  return held_by(impl_, "bounded posterior");
}

void BoundedPosterior::reset() {
  Impl& posterior = impl();
  posterior.elements = {};
  posterior.touched = false;
  posterior.prior_log_likelihood = 0.0;
  posterior.found.reset();
  if (posterior.none) {
    posterior.none->reset();
  }
}

void BoundedPosterior::move_pivot(const glm::dvec2& pivot_mm) {
  Impl& posterior = impl();
  posterior.options.lattice =
      with_pivot(posterior.options.lattice, pivot_mm, "bounded posterior", posterior.touched);
  posterior.likelihood.move_pivot(pivot_mm);
  if (posterior.none) {
    posterior.none->move_pivot(pivot_mm);
  }
  posterior.found.reset();
}

void BoundedPosterior::update(std::span<const Touch> touches,
                              const std::function<void(double)>& progress) {
  Impl& posterior = impl();
  const KnownElements added = gather_elements(touches, posterior.options.contact,
                                              posterior.options.lattice.pivot_mm);
  std::vector<TouchMean> means;
  if (posterior.none) {
    const int threads = posterior.options.threads;
    tbb::task_arena(threads > 0 ? threads : tbb::task_arena::automatic).execute([&] {
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
  KnownElements elements = merged(posterior.elements, added);
  if (posterior.none) {
    posterior.none->add(means);
  }
  posterior.elements = std::move(elements);
  for (const ReadingRun& run : added.runs) {
    posterior.prior_log_likelihood +=
        static_cast<double>(run.end - run.begin) *
        palpate::prior_log_likelihood(run.reading, posterior.options.contact);
  }
  posterior.touched = posterior.touched || !touches.empty();
  posterior.found.reset();
}

Estimate BoundedPosterior::estimate() const {
  Impl& posterior = impl();
  const SearchResult& found = posterior.search();
  Estimate estimate;
  std::vector<double> logs;
  Certificate certificate{.mode_certain = found.mode_certain,
                          .blocks_bounded = found.blocks_bounded,
                          .bins_evaluated = found.bins_evaluated};
  for (const HypothesisEvidence& evidence : found.evidence) {
    logs.push_back(evidence.log_evaluated);
    certificate.log_evidence.push_back({evidence.log_evaluated, evidence.log_evaluated});
  }
  if (const auto none = posterior.none_log_evidence()) {
    logs.push_back(*none);
    certificate.none_standard_error = posterior.none->standard_error();
  }
  estimate.identity = normalised(logs);
  if (posterior.none) {
    estimate.none = estimate.identity.back();
    estimate.identity.pop_back();
  }
  for (const double p : estimate.identity) {
    estimate.identity_bounds.push_back({p, p});
  }
  estimate.certificate = std::move(certificate);
  estimate.mode = {.object = found.best_object,
                   .bin = found.best_bin,
                   .T_object_robot = lattice().T_object_robot(found.best_bin),
                   .log_likelihood = found.best_log_likelihood};
  // The best bin of any object, which need not be the mode's where weights differ.
  const double best = *std::max_element(found.bins.log_likelihood.begin(),
                                        found.bins.log_likelihood.end());
  estimate.contradicted = posterior.prior_log_likelihood - best > contradiction_nats;
  return estimate;
}

RefinedPose BoundedPosterior::refine(const Mode& mode) const {
  Impl& posterior = impl();
  posterior.require_object(mode.object);
  const auto log_likelihood = [&](const BinWindow& window) {
    std::vector<BinBox> boxes;
    const int thetas = lattice().theta_rad.count;
    for (int t = 0; t < window.theta_count; ++t) {
      boxes.push_back({mode.object, ((window.theta_first + t) % thetas + thetas) % thetas,
                       window.row_first, window.row_count, window.column_first,
                       window.column_count});
    }
    std::vector<double> logs(window.bins());
    posterior.likelihood.evaluate(boxes, posterior.elements, std::span(logs));
    return logs;
  };
  return palpate::refine(log_likelihood, lattice(), posterior.bodies[mode.object], mode);
}

Marginals BoundedPosterior::marginals(int object) const { return marginals(object, lattice()); }

Marginals BoundedPosterior::marginals(int object, const PoseLattice& grid) const {
  Impl& posterior = impl();
  posterior.require_object(object);
  PoseLattice onto = grid;
  onto.collapse_fixed().validate();
  const SearchResult& found = posterior.search();
  double log_total = -std::numeric_limits<double>::infinity();
  {
    std::vector<double> logs;
    for (const HypothesisEvidence& evidence : found.evidence) {
      logs.push_back(evidence.log_evaluated);
    }
    if (const auto none = posterior.none_log_evidence()) {
      logs.push_back(*none);
    }
    const double most = *std::max_element(logs.begin(), logs.end());
    double sum = 0.0;
    for (const double l : logs) {
      sum += std::exp(l - most);
    }
    log_total = most + std::log(sum);
  }
  Marginals sums{.grid = onto,
                 .xy = std::vector<double>(static_cast<std::size_t>(onto.plane())),
                 .theta = std::vector<double>(static_cast<std::size_t>(onto.theta_rad.count))};
  std::size_t k = 0;
  for (const BinBox& box : found.bins.boxes) {
    for (std::int64_t i = 0; i < box.bins(); ++i, ++k) {
      if (box.object != object) {
        continue;
      }
      const double p =
          std::exp(posterior.log_weight[object] + found.bins.log_likelihood[k] - log_total);
      const std::int64_t bin =
          (std::int64_t{box.theta} * lattice().y_mm.count + box.y_first + i / box.x_count) *
              lattice().x_mm.count +
          box.x_first + i % box.x_count;
      const std::int64_t at = onto.bin_of(lattice().T_object_robot(bin));
      sums.xy[at % onto.plane()] += p;
      sums.theta[at / onto.plane()] += p;
    }
  }
  return sums;
}

double BoundedPosterior::log_likelihood(int object, const Pose& T_object_robot) const {
  Impl& posterior = impl();
  posterior.require_object(object);
  const auto& [translation_mm, theta_rad] = T_object_robot;
  if (!std::isfinite(translation_mm.x) || !std::isfinite(translation_mm.y) ||
      !std::isfinite(theta_rad)) {
    throw Error(Fault::input, fmt::format("pose {}, {}, {}: give finite numbers", translation_mm.x,
                                          translation_mm.y, theta_rad));
  }
  const ContactModel& contact = posterior.options.contact;
  const InterpolatedMap map(posterior.hypotheses[object].map, *contact.prior);
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
  impl();
  return 0.0;
}

std::vector<PoseSample> BoundedPosterior::sample(std::size_t count, std::uint64_t seed) const {
  Impl& posterior = impl();
  const SearchResult& found = posterior.search();
  Random random(seed, Stream::belief);
  std::vector<PoseSample> samples;
  for (std::size_t i = 0; i < count; ++i) {
    samples.push_back({found.best_object, lattice().T_object_robot(found.best_bin)});
  }
  return samples;
}

const PoseLattice& BoundedPosterior::lattice() const { return impl().options.lattice; }

std::string BoundedPosterior::path() const {
  impl();
  return "plain loop";
}

std::uint64_t BoundedPosterior::host_bytes() const {
  impl();
  return 0;
}

}  // namespace palpate
