#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

/// An answer of the bounded posterior, and what it took.
struct BoundedAnswer {
  double seconds = 0.0;  ///< of update() and estimate()
  Estimate estimate;

  const Certificate& certificate() const { return *estimate.certificate; }
};

/// Takes in the touches and asks once; what was known before counts too.
BoundedAnswer answer(BoundedPosterior& posterior, std::span<const Touch> touches);

/// Answers over several unknowns.
struct BoundedAnswers {
  std::vector<BoundedAnswer> all = {};

  std::vector<double> milliseconds() const;
  std::vector<double> bins_evaluated() const;
  std::vector<double> dropped_masses() const;
  int with_certain_mode() const;
};

/// Asks once about each unknown after all of its touches, from the uniform belief on. The first
/// unknown is asked about once more before, which does not count.
BoundedAnswers answer_each(BoundedPosterior& posterior, std::span<const Recording> unknowns);

/// Seconds of update() and estimate() of a dense histogram over each unknown, and its modes.
struct DenseAnswers {
  std::vector<double> seconds = {};
  std::vector<Mode> modes = {};
};
DenseAnswers answer_each(PoseHistogram& histogram, std::span<const Recording> unknowns);

/// How many of the dense modes the bounded answers have too, by bin or by likelihood up to 1e-3
/// nats, by which the histogram's float32 may order two bins otherwise.
int same_modes(const BoundedAnswers& bounded, const DenseAnswers& dense);

/// Median seconds by which a new posterior's first answer takes longer than the same answer after
/// reset(): what the tables cost, whenever they are built.
double table_seconds(std::span<const Hypothesis> objects, const BoundedOptions& options,
                     const Recording& unknown, int repeats);

/// Rows of times, bins evaluated and certificate. `name` begins the names of the times.
std::vector<Measurement> measurements_of(const BoundedAnswers& answers, const std::string& name,
                                         std::int64_t bins_in_all,
                                         std::optional<Goal> median_ms = {});
/// Every answer's figures, [unknown] each.
Json record_of(const BoundedAnswers& answers);

}  // namespace palpate::bench
