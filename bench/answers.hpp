#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "letters.hpp"
#include "palpate/estimate.hpp"
#include "report.hpp"

namespace palpate::bench {

/// Answers of a belief, [unknown], and what they took.
struct Answers {
  std::vector<double> seconds = {};  ///< of update() and estimate()
  std::vector<Estimate> estimates = {};

  /// Takes in the touches and asks once; what was known before counts too.
  template <typename Belief>
  const Estimate& ask(Belief& belief, std::span<const Touch> touches) {
    Estimate& estimate = estimates.emplace_back();
    seconds.push_back(seconds_of([&] {
      belief.update(touches);
      estimate = belief.estimate();
    }));
    return estimate;
  }
  void add(const Answers& others) {
    seconds.insert(seconds.end(), others.seconds.begin(), others.seconds.end());
    estimates.insert(estimates.end(), others.estimates.begin(), others.estimates.end());
  }
  double median_ms() const { return 1e3 * median(seconds); }
  /// A number of the certificates, which bounds alone have.
  template <typename Number>
  std::vector<double> certified(Number Certificate::*number) const {
    std::vector<double> numbers;
    for (const Estimate& estimate : estimates) {
      numbers.push_back(static_cast<double>((*estimate.certificate).*number));
    }
    return numbers;
  }
  int modes_certain() const {
    return static_cast<int>(std::ranges::count(certified(&Certificate::mode_certain), 1.0));
  }
  /// The figures of every answer by bounds, [unknown] each.
  Json record() const {
    std::vector<double> milliseconds = seconds;
    std::ranges::for_each(milliseconds, [](double& s) { s *= 1e3; });
    return {{"milliseconds", milliseconds},
            {"bins_evaluated", certified(&Certificate::bins_evaluated)},
            {"dropped_mass", certified(&Certificate::dropped_mass)},
            {"mode_certain", modes_certain()}};
  }
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
inline std::vector<Measurement> measurements_of(const Answers& answers, const std::string& name,
                                                std::int64_t bins_in_all,
                                                std::optional<Goal> median_ms) {
  const double evaluated = median(answers.certified(&Certificate::bins_evaluated));
  return {{name + ", median", answers.median_ms(), "ms", median_ms},
          {name + ", least", 1e3 * std::ranges::min(answers.seconds), "ms"},
          {name + ", most", 1e3 * std::ranges::max(answers.seconds), "ms"},
          {"bins evaluated, median", evaluated, "bins"},
          {"of all bins", 100.0 * evaluated / static_cast<double>(bins_in_all), "%"},
          {"certificate, largest", std::ranges::max(answers.certified(&Certificate::dropped_mass)),
           "mass"},
          share_of("mode certain", answers.modes_certain(), answers.estimates.size())};
}

}  // namespace palpate::bench
