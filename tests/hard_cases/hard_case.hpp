#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/pose_histogram.hpp"
#include "synthetic.hpp"

namespace palpate {

// AddressSanitizer makes float64 ten times as slow: a few cases are smaller under it.
#ifdef __SANITIZE_ADDRESS__
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// What may differ from float64, and by how much. None of it depends on what is measured.
struct Allowed {
  double nats = 1e-4;     ///< of a log-likelihood; 0.8e-5 to 1.8e-5 are seen
  double relative = 0.0;  ///< of the log-likelihood itself, besides
  /// Of the log posterior near its top; by default twice as much as of the log-likelihoods.
  std::optional<double> near_top_nats = {};
  /// Of identities: sums of float32 terms, at most 16,384 to a part, of which 2.3e-7 is seen; and
  /// twice the error in nats of the log posterior where it says little.
  double identity = 2e-6;
  /// Of marginals, which have the error in nats of a few bins: up to 1.6e-5 times a probability.
  double marginal = 2e-5;

  double at(double log_likelihood) const;
};

/// A case of docs/hard_cases.md. Prints the case's row of the table there when it ends.
class HardCase {
 public:
  HardCase(std::string name, std::string risk, std::string bound);
  ~HardCase();
  HardCase(const HardCase&) = delete;
  HardCase& operator=(const HardCase&) = delete;

  /// Expects the error to be within what is allowed, and keeps the largest of every quantity.
  void expect(const std::string& quantity, double error, double allowed);

  /// Runs a histogram over the touches and expects all that it says to be finite and as float64 has
  /// it: every bin, the posterior near its top, identity, mode, marginals and their sums.
  Estimate expect_posterior(Device& device, std::span<const Hypothesis> objects,
                            const HistogramOptions& options, std::span<const Touch> touches,
                            Allowed allowed = {});
  /// The same of touches that are given `times` over: float64 sums them once.
  Estimate expect_posterior_of_repeated(Device& device, std::span<const Hypothesis> objects,
                                        const HistogramOptions& options,
                                        std::span<const Touch> touches, int times, Allowed allowed);

  /// Expects a map's cell to be within what MapBuilder promises: 1e-3 nats or a relative 1e-4.
  void expect_cell(double log_odds, double expected);
  /// Builds a map of the touches and expects every cell to be finite and as float64 has it.
  OccupancyGrid expect_map(Device& device, std::span<const Touch> touches,
                           const MapOptions& options);

 private:
  struct Largest {
    double error = 0.0;
    double allowed = 0.0;
  };

  /// As expect(), of what follows from the log-likelihoods and has no place in the table.
  void check(const std::string& quantity, double error, double allowed) const;

  std::string name_;
  std::string risk_;
  std::string bound_;
  std::map<std::string, Largest> largest_;
};

/// Whether no number among them is infinite or not a number.
bool all_finite(std::span<const double> numbers);

/// The sum of the numbers.
double total(std::span<const double> numbers);

}  // namespace palpate
