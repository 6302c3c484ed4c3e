#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "letters.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

/// Answers of a belief, [unknown], and what they took.
struct Answers {
  std::vector<double> seconds = {};  ///< of update() and estimate()
  std::vector<Mode> modes = {};
  // Bounds alone have these:
  std::vector<double> bins_evaluated = {};
  std::vector<double> dropped_mass = {};
  int mode_certain = 0;

  /// Takes in the touches and asks once; what was known before counts too.
  template <typename Belief>
  Estimate ask(Belief& belief, std::span<const Touch> touches) {
    Estimate estimate;
    seconds.push_back(seconds_of([&] {
      belief.update(touches);
      estimate = belief.estimate();
    }));
    note(estimate);
    return estimate;
  }
  /// Adds other answers to these.
  void add(const Answers& others);
  double median_ms() const { return 1e3 * median(seconds); }
  /// The figures of every answer by bounds, [unknown] each.
  Json record() const;

 private:
  void note(const Estimate& estimate);
};

/// Asks once about each unknown after all of its touches, from the uniform belief on.
/// @param warm_up asks about the first unknown once more before, which does not count
template <typename Belief>
Answers answer_each(Belief& belief, std::span<const Recording> unknowns, bool warm_up) {
  belief.reset();
  if (warm_up) {
    Answers().ask(belief, all_touches(unknowns.front()));
  }
  Answers answers;
  for (const Recording& unknown : unknowns) {
    belief.reset();
    answers.ask(belief, all_touches(unknown));
  }
  return answers;
}

/// Rows of times, bins evaluated and certificate. `name` begins the names of the times.
std::vector<Measurement> measurements_of(const Answers& answers, const std::string& name,
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
/// The blocks of poses that one search goes into after 1, 3 and 9 touches, for a picture.
Json measure_bounded_search(const BoundedInputs& inputs, Report& report);

}  // namespace palpate::bench
