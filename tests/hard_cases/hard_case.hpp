#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "palpate/map_builder.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/certified.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"
#include "support/trials.hpp"

namespace palpate {

/// Differences from float64 that a case allows. They do not depend on measured errors.
struct Allowed {
  double nats = 1e-4;     ///< error of a log-likelihood, in nats; 0.8e-5 to 1.8e-5 nats are seen
  double relative = 0.0;  ///< further error, as a share of the log-likelihood
  /// Error of the log posterior near its top, in nats; by default twice the log-likelihoods' error.
  std::optional<double> near_top_nats = {};
  /// Error of identities: float32 sums of at most 16,384 terms (2.3e-7 is seen), and twice the log
  /// posterior's error, in nats, if the posterior is broad.
  double identity = 2e-6;
  /// Error of marginals, from a few bins' errors in nats: up to 1.6e-5 of a probability is seen.
  double marginal = 2e-5;

  double at(double log_likelihood) const;
};

/// A case of docs/hard_cases.md, which says by this name what could go wrong and what bounds the
/// error. Its destructor prints the largest errors for the case's row there.
class HardCase {
 public:
  explicit HardCase(std::string name) : name_(std::move(name)) {}
  ~HardCase();
  HardCase(const HardCase&) = delete;
  HardCase& operator=(const HardCase&) = delete;

  /// Expects the error to be allowed, and keeps each quantity's largest, of what is allowed.
  void expect(const std::string& quantity, double error, double allowed);

  /// Runs a histogram over the touches, so many times, and expects finite results that agree with
  /// float64, which sums them once: every bin, the posterior near its top, identity, mode,
  /// marginals and their sums.
  Estimate expect_posterior(std::span<const Hypothesis> objects, const HistogramOptions& options,
                            std::span<const Touch> touches, Allowed allowed = {}, int times = 1);

  /// Expects the laws of a posterior by bounds, see palpate::expect_laws(), and its answers to be
  /// the tolerance away from float64 at most.
  /// @param nats what rounding may add to a log-likelihood
  /// @returns what was seen after the last touch
  Certified expect_laws(std::span<const Hypothesis> objects, const BoundedOptions& options,
                        const Recording& recording, double nats = 1e-9);
  /// As a histogram of these options has them.
  Certified expect_laws(std::span<const Hypothesis> objects, const HistogramOptions& options,
                        const Recording& recording, double nats = 1e-9);

  /// Gives the touches to particles one by one, and expects finite results and, after each touch,
  /// every particle's weight to agree with float64 at the particle's pose.
  /// @returns the filter after the last touch
  ParticleFilter expect_particles(std::span<const Hypothesis> objects,
                                  const ParticleOptions& options, const Recording& recording,
                                  double allowed_nats = 1e-4);

  /// Builds a map of the touches and expects finite cells that agree with float64 within
  /// MapBuilder's promise: 1e-3 nats or a relative 1e-4.
  OccupancyGrid expect_map(std::span<const Touch> touches, const MapOptions& options);

 private:
  struct Largest {
    double error = 0.0;
    double allowed = 0.0;
  };

  /// As expect(), for a quantity that the table leaves out as it follows from the log-likelihoods.
  void check(const std::string& quantity, double error, double allowed) const;

  std::string name_;
  std::map<std::string, Largest> largest_;
};

/// 5 x 6 x 4 bins over 10 x 10 mm and all angles.
HistogramOptions small_options();
/// 2,000 particles over 10 x 10 mm and all angles about a pivot.
ParticleOptions two_thousand_particles(const glm::dvec2& pivot_mm = {});

/// Whether all numbers are finite.
bool all_finite(std::span<const double> numbers);
bool is_finite(const Pose& pose);
/// Expects finite numbers and no negative variance.
void expect_finite(const RefinedPose& refined);

}  // namespace palpate
