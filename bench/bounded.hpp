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

/// Answers of the bounded posterior, [unknown], and what they took.
struct BoundedAnswers {
  std::vector<double> milliseconds = {};  ///< of update() and estimate()
  std::vector<double> bins_evaluated = {};
  std::vector<double> dropped_mass = {};
  std::vector<Mode> modes = {};
  int mode_certain = 0;

  /// Takes in the touches and asks once; what was known before counts too.
  Estimate ask(BoundedPosterior& posterior, std::span<const Touch> touches);
  /// Adds other answers to these.
  void add(const BoundedAnswers& others);
  /// Every answer's figures, [unknown] each.
  Json record() const;
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

/// Rows of times, bins evaluated and certificate. `name` begins the names of the times.
std::vector<Measurement> measurements_of(const BoundedAnswers& answers, const std::string& name,
                                         std::int64_t bins_in_all,
                                         std::optional<Goal> median_ms = {});

/// What the parts of `palpate-bench bounded` work on.
struct BoundedInputs {
  Device& device;
  const std::vector<Hypothesis>& letters;
  bool quick = false;

  int unknowns() const { return quick ? 3 : 20; }
  std::int64_t bins_in_all(const PoseLattice& lattice) const {
    return lattice.bins() * static_cast<std::int64_t>(letters.size());
  }
};

// Each part adds its cases to the report and returns a record of every run.

/// Many objects, far away: time and memory.
Json measure_bounded_large(const BoundedInputs& inputs, Report& report);
/// Time over bins, from 10^4 to 10^9 in all, beside the dense engine.
Json measure_bounded_growth(const BoundedInputs& inputs, Report& report);
/// The blocks of poses that one search goes into after 1, 3 and 9 touches, for a picture.
Json measure_bounded_search(const BoundedInputs& inputs, Report& report);

}  // namespace palpate::bench
