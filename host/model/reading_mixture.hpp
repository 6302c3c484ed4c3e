#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/random.hpp"
#include "palpate/contact.hpp"

namespace palpate {

/// Lists of hypotheses are padded to a multiple of this.
inline constexpr std::size_t mixture_lanes = 8;

/// What equally likely hypotheses, such as poses drawn from a belief, say about the readings of one
/// touch. No element is Unknown; given the hypothesis, elements are independent.
class ReadingMixture {
 public:
  ReadingMixture(std::size_t hypotheses, std::size_t elements, std::size_t levels);

  std::size_t hypotheses() const { return hypotheses_; }
  std::size_t elements() const { return elements_; }
  std::size_t levels() const { return levels_; }

  /// What one hypothesis says: the log-likelihood of every reading, [element, level], in nats, as
  /// MapLikelihood::all_readings() gives it.
  void set(std::size_t hypothesis, std::span<const double> log_likelihoods) {
    for (std::size_t i = 0; i < log_likelihoods.size(); ++i) {
      log_likelihood_[i * stride_ + hypothesis] = log_likelihoods[i];
    }
  }

  /// log of the mean likelihood of the readings, [element], over all hypotheses, in nats.
  double log_mean(std::span<const Reading> readings) const;

 private:
  friend class PredictedTouches;

  const double* row(std::size_t element, std::size_t level) const {
    return log_likelihood_.data() + (element * levels_ + level) * stride_;
  }

  std::size_t hypotheses_;
  std::size_t stride_;  ///< of rows: the hypotheses, padded
  std::size_t elements_;
  std::size_t levels_;
  std::vector<double> log_likelihood_;  ///< [element, level, hypothesis]
};

/// Touches as the hypotheses of a mixture predict them: a hypothesis gives reading r of an element
/// the probability q(r) = P(r) / sum over all r' of P(r'), with P the likelihood.
class PredictedTouches {
 public:
  /// @param mixture outlives this object
  explicit PredictedTouches(const ReadingMixture& mixture);

  struct DrawnTouch {
    std::vector<Reading> readings;
    double log_likelihood = 0.0;  ///< of the readings under the hypothesis, in nats
    double mean = 0.0;            ///< of that log-likelihood over all such touches
    double variance = 0.0;
  };
  DrawnTouch draw(std::size_t hypothesis, Random& random) const;

 private:
  const ReadingMixture& mixture_;
  std::vector<double> probability_;  ///< [element, level, hypothesis]
  std::vector<double> mean_;         ///< [hypothesis]
  std::vector<double> variance_;
};

/// Mean and variance of a log-likelihood.
struct Moments {
  double mean = 0.0;
  double variance = 0.0;
};

/// Mean and variance of `judge.log_mean()` over touches as `source` predicts them: one touch is
/// drawn from each of its hypotheses. The log-likelihood under the touch's own hypothesis, whose
/// moments are sums over the elements, serves as control variate (regression estimator), so that
/// readings too rare to be drawn still count.
Moments predicted_log_mean(const ReadingMixture& judge, const ReadingMixture& source,
                           Random& random);

}  // namespace palpate
