#include "none_run.hpp"

#include <cmath>
#include <limits>
#include <numeric>

#include "fit_run.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t learned_seed = 600'000'000;
constexpr std::uint64_t unlearned_seed = 700'000'000;

/// The log of a probability that may have left the range of doubles.
double log_of(double probability) {
  return std::log(std::max(probability, std::numeric_limits<double>::min()));
}

}  // namespace

void NoneCalls::add(const RecognitionStep& step) {
  const std::span<const double> letters = std::span(step.identity).first(step.identity.size() - 1);
  log_odds.push_back(log_of(step.identity.back()) -
                     log_of(std::accumulate(letters.begin(), letters.end(), 0.0)));
  called_none += step.best == letters.size() ? 1 : 0;
}

double NoneCalls::share_called_none() const {
  return static_cast<double>(called_none) / static_cast<double>(log_odds.size());
}

double NoneRun::told_apart() const {
  return bench::told_apart(learned.log_odds, unlearned.log_odds);
}

Interval NoneRun::told_apart_interval() const {
  return bench::told_apart_interval(learned.log_odds, unlearned.log_odds);
}

std::vector<NoneRun> run_none(Device& device, const std::vector<Hypothesis>& letters,
                              const NoneSetting& setting, std::span<const int> touches) {
  const double weight = std::accumulate(
      letters.begin(), letters.end(), 0.0,
      [](double sum, const Hypothesis& hypothesis) { return sum + hypothesis.weight; });
  const RecognitionTask task(letters, HistogramOptions{.lattice = setting.lattice,
                                                       .none_weight = weight,
                                                       .touch_sd = setting.touch_sd});
  PoseHistogram histogram = histogram_of(device, task);
  std::vector<NoneRun> runs;
  for (const int count : touches) {
    runs.push_back({.touches = count});
  }
  const auto add = [&](std::span<const std::string> shapes, int trials_each, std::uint64_t seed,
                       NoneCalls NoneRun::*calls) {
    for (const Recording& trial :
         make_trials(shapes, trials_each, touches.back(), seed, setting.touching)) {
      const std::vector<RecognitionStep> steps = steps_after(histogram, task, trial, touches);
      for (std::size_t i = 0; i < runs.size(); ++i) {
        (runs[i].*calls).add(steps[i]);
      }
    }
  };
  add(vowels, setting.learned_each, learned_seed, &NoneRun::learned);
  add(misfits, setting.unlearned_each, unlearned_seed, &NoneRun::unlearned);
  return runs;
}

}  // namespace palpate::bench
