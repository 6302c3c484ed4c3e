#include "none_run.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "palpate/contact_model.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

namespace {

/// log of the mean over the bins, of which these are the logs.
double log_mean(std::span<const double> log_likelihood) {
  const double most = *std::max_element(log_likelihood.begin(), log_likelihood.end());
  double sum = 0.0;
  for (const double value : log_likelihood) {
    sum += std::exp(value - most);
  }
  return most + std::log(sum / static_cast<double>(log_likelihood.size()));
}

/// Log-likelihood of touches under a map that holds only the prior, the same at every pose (Eq. 7).
double log_likelihood_of_none(std::span<const Touch> touches, const ContactModel& model) {
  const MapSample prior{.log_odds = log_odds_from_probability(*model.prior)};
  double sum = 0.0;
  for (const Touch& touch : touches) {
    for (const Reading reading : model.classify(touch)) {
      sum += model.log_likelihood(reading, prior);
    }
  }
  return sum;
}

/// Every hypothesis is as probable as its weight times its mean likelihood over the poses, so that
/// one belief says for all weights which is the most probable. In logs: their ratio may leave the
/// range of doubles.
double turning_log10_weight(const PoseHistogram& histogram, int objects,
                            double none_log_likelihood) {
  double most = -std::numeric_limits<double>::infinity();
  for (int object = 0; object < objects; ++object) {
    most = std::max(most, log_mean(histogram.log_likelihood(object)));
  }
  return (most - none_log_likelihood) / std::numbers::ln10;
}

double fraction_below(std::span<const double> values, double limit) {
  const auto below =
      std::count_if(values.begin(), values.end(), [limit](double value) { return value < limit; });
  return static_cast<double>(below) / static_cast<double>(values.size());
}

}  // namespace

double NoneRun::lost(double log10_weight) const {
  return fraction_below(learned_log10_weight, log10_weight);
}

double NoneRun::noticed(double log10_weight) const {
  return fraction_below(unlearned_log10_weight, log10_weight);
}

double NoneRun::separation() const {
  double sum = 0.0;
  for (const double learned : learned_log10_weight) {
    sum += noticed(learned);
  }
  return sum / static_cast<double>(learned_log10_weight.size());
}

std::vector<NoneRun> run_none(Device& device, std::span<const Hypothesis> letters,
                              std::span<const Recording> learned_trials,
                              std::span<const Recording> unlearned_trials,
                              const PoseLattice& lattice, std::span<const int> touches) {
  PoseHistogram histogram(device, letters, HistogramOptions{.lattice = lattice});
  const ContactModel model{.prior = letters.front().map.prior};
  std::vector<NoneRun> runs;
  for (const int n : touches) {
    runs.push_back({.touches = n, .learned_log10_weight = {}, .unlearned_log10_weight = {}});
  }
  for (const auto& [trials, weights] :
       {std::pair(learned_trials, &NoneRun::learned_log10_weight),
        std::pair(unlearned_trials, &NoneRun::unlearned_log10_weight)}) {
    for (const Recording& trial : trials) {
      histogram.reset();
      std::size_t done = 0;
      for (NoneRun& run : runs) {
        const auto until = static_cast<std::size_t>(run.touches);
        histogram.update(trial.touches(done, until));
        const double none = log_likelihood_of_none(trial.touches(0, until), model);
        (run.*weights)
            .push_back(turning_log10_weight(histogram, static_cast<int>(letters.size()), none));
        done = until;
      }
    }
  }
  return runs;
}

}  // namespace palpate::bench
