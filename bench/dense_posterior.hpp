#pragma once

#include <span>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

/// The posterior over all bins that a bounded one is held against.
struct DensePosterior {
  std::vector<double> log_evidence;  ///< [object] prior weight times summed likelihood, in nats
  std::vector<double> identity;      ///< [object]
  std::vector<Marginals> marginals;  ///< [object], on the histogram's lattice
  Mode mode;
};

/// The posterior over the bins of a histogram that has taken in `touches`. Bins that hold all but
/// 1e-6 of an object's mass are evaluated again by the float64 reference, so that the histogram's
/// float32 steps, some 4e-6 nats, do not count; of the others the histogram's values are taken.
DensePosterior dense_posterior(const PoseHistogram& histogram,
                               std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                               std::span<const Touch> touches);

/// What a certificate promised and how far the answer really was from the dense posterior.
struct CertificateCheck {
  double promised = 0.0;         ///< dropped_mass
  double mass_outside = 0.0;     ///< of the dense posterior, in bins that were not counted
  double total_variation = 0.0;  ///< largest between marginals; at most that of the posteriors
  double identity_error = 0.0;   ///< largest of any object's probability
  bool same_mode = false;        ///< the same bin, or one of the same likelihood
  bool bounds_hold = false;      ///< evidence and identity of every object lie in their intervals

  /// The largest of the measured errors, which the certificate bounds.
  double measured() const;
  bool holds() const;
};

/// Rounding of the sums in float64 on both sides: below it nothing is measured.
inline constexpr double summing_error = 1e-11;

/// Holds the posterior's estimate and marginals against all bins of the same lattice.
/// @throws Error where the estimate has no certificate
CertificateCheck check_certificate(const BoundedPosterior& bounded, const DensePosterior& dense);

}  // namespace palpate::bench
