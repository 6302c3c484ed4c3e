#pragma once

#include <span>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// The posterior over all bins in float64, from the reference.
reference::Posterior reference_posterior(std::span<const Hypothesis> objects,
                                         const BoundedOptions& options,
                                         std::span<const Touch> touches);

/// What a bounded posterior's answers differ by from the posterior over all bins.
struct Certified {
  Estimate estimate;
  double identity_error = 0.0;   ///< largest, of a probability
  double total_variation = 0.0;  ///< largest of identities and of any object's marginals
  double widest_nats = 0.0;      ///< widest interval of a label's log evidence
};

/// Expects all that a certificate promises of a posterior after the touches that `truth` knows:
///   - log evidences and identities lie within their bounds,
///   - the total variation from `truth`, of identities and of marginals, and the mass of `truth`
///     where the marginals are 0 are at most dropped_mass, which is at most the tolerance and what
///     rounding adds where there is no budget,
///   - the entropy is that of `truth` where the tolerance is small,
///   - the mode has its log-likelihood, and is the best of all bins where there is no budget or
///     the certificate says so,
///   - the log-likelihood of any pose is the reference's.
/// @param nats what rounding, of the reference's float64 too, may add to a log-likelihood
Certified expect_certified(const BoundedPosterior& posterior, std::span<const Hypothesis> objects,
                           const BoundedOptions& options, const reference::Posterior& truth,
                           double nats = 1e-9);

/// Expects all of this of a new posterior after the touches.
Certified expect_certified(std::span<const Hypothesis> objects, const BoundedOptions& options,
                           std::span<const Touch> touches, double nats = 1e-9);

/// Expects the laws of a posterior of these touches:
///   - before any touch and after each, it is certified,
///   - to the bit, it tells the same after all touches at once, also where it is asked again, and
///     on one thread in another order, asked after each touch, of which the first stays the first
///     ("none of these" counts its place), and after a reset, and after searches that were
///     cancelled,
///   - in a robot frame that has moved, it is certified by the same float64.
/// With "none of these", which float64 here leaves out, expects no certificate.
/// @param nats what rounding, of the reference's float64 too, may add to a log-likelihood
/// @returns what was seen before any touch and after each
std::vector<Certified> expect_laws(std::span<const Hypothesis> objects,
                                   const BoundedOptions& options, const Recording& recording,
                                   double nats = 1e-9);

/// All numbers that a posterior tells, but the counts of its search and what a budget decides.
std::vector<std::vector<double>> all_answers(const BoundedPosterior& posterior,
                                             std::size_t objects);

}  // namespace palpate
