#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/reading_mixture.hpp"
#include "palpate/fit.hpp"
#include "palpate/touch.hpp"
#include "support/every_set_of_instructions.hpp"

namespace palpate::reading_mixture_test {

constexpr Reading no = Reading::no_contact;
constexpr Reading yes = Reading::in_contact;

/// The log-likelihoods of elements that are in contact with these probabilities.
std::vector<double> logs_of(const std::vector<double>& contact) {
  std::vector<double> logs;
  for (const double p : contact) {
    logs.push_back(std::log1p(-p));
    logs.push_back(std::log(p));
  }
  return logs;
}

ReadingMixture two_hypotheses() {
  ReadingMixture mixture(2, 2, 2);
  mixture.set(0, logs_of({0.9, 0.2}));
  mixture.set(1, logs_of({0.5, 0.5}));
  return mixture;
}

constexpr double rounding = 1e-12;

TEST(ReadingMixture, AveragesLikelihoods) {
  const ReadingMixture mixture = two_hypotheses();
  EXPECT_NEAR(mixture.log_mean(std::vector{yes, no}), std::log((0.9 * 0.8 + 0.25) / 2.0), rounding);
  EXPECT_NEAR(mixture.log_mean(std::vector{no, yes}), std::log((0.1 * 0.2 + 0.25) / 2.0), rounding);
}

TEST(ReadingMixture, StaysInRange) {
  ReadingMixture mixture(2, 1, 2);
  mixture.set(0, std::vector{-5000.0, -2000.0});
  mixture.set(1, std::vector{-5001.0, -1e30});
  EXPECT_NEAR(mixture.log_mean(std::vector{no}), -5000.0 + std::log((1.0 + std::exp(-1.0)) / 2.0),
              1e-9);
  EXPECT_NEAR(mixture.log_mean(std::vector{yes}), -2000.0 - std::log(2.0), 1e-9);
}

TEST(ReadingMixture, DrawsWhatAHypothesisPredicts) {
  const ReadingMixture mixture = two_hypotheses();
  Random random(1, Stream::readings);
  constexpr int draws = 4000;
  int first = 0;
  int second = 0;
  double sum = 0.0;
  double squares = 0.0;
  const PredictedTouches predicted(mixture);
  PredictedTouches::DrawnTouch touch;
  for (int i = 0; i < draws; ++i) {
    touch = predicted.draw(0, random);
    first += touch.readings[0] == yes ? 1 : 0;
    second += touch.readings[1] == yes ? 1 : 0;
    EXPECT_NEAR(touch.log_likelihood,
                std::log(touch.readings[0] == yes ? 0.9 : 0.1) +
                    std::log(touch.readings[1] == yes ? 0.2 : 0.8),
                rounding);
    sum += touch.log_likelihood - touch.mean;
    squares += std::pow(touch.log_likelihood - touch.mean, 2.0);
  }
  // Four standard errors.
  EXPECT_NEAR(first, 0.9 * draws, 4.0 * std::sqrt(0.09 * draws));
  EXPECT_NEAR(second, 0.2 * draws, 4.0 * std::sqrt(0.16 * draws));
  const double mean =
      0.9 * std::log(0.9) + 0.1 * std::log(0.1) + 0.2 * std::log(0.2) + 0.8 * std::log(0.8);
  EXPECT_NEAR(touch.mean, mean, rounding);
  EXPECT_NEAR(sum / draws, 0.0, 4.0 * std::sqrt(touch.variance / draws));
  EXPECT_NEAR(squares / draws, touch.variance, 0.1 * touch.variance) << "a kurtosis of about 3";
}

TEST(ReadingMixture, PredictsExactlyWhereAllHypothesesAgree) {
  ReadingMixture mixture(8, 3, 2);
  for (std::size_t h = 0; h < 8; ++h) {
    mixture.set(h, logs_of({0.7, 0.01, 1e-6}));
  }
  Random random(2, Stream::readings);
  const Moments predicted = predicted_log_mean(mixture, mixture, random);
  double mean = 0.0;
  double variance = 0.0;
  for (const double p : {0.7, 0.01, 1e-6}) {
    const double between = std::log(p) - std::log1p(-p);
    mean += p * std::log(p) + (1.0 - p) * std::log1p(-p);
    variance += p * (1.0 - p) * between * between;
  }
  // Nothing is left to chance: the control variate is the log-likelihood itself.
  EXPECT_NEAR(predicted.mean, mean, 1e-9);
  EXPECT_NEAR(predicted.variance, variance, 1e-9);
}

TEST(ReadingMixture, EverySetOfInstructionsGivesTheSameBits) {
  ReadingMixture mixture(14, 3, 2);  // not a whole number of vectors
  Random random(4, Stream::readings);
  for (std::size_t h = 0; h < 14; ++h) {
    mixture.set(h, logs_of({random.uniform(0.02, 0.98), random.uniform(0.02, 0.98), 0.5}));
  }
  const auto answers = [&] {
    Random draws(5, Stream::readings);
    const Moments moments = predicted_log_mean(mixture, mixture, draws);
    const PredictedTouches predicted(mixture);
    std::vector<double> all{mixture.log_mean(std::vector{yes, no, yes}), moments.mean,
                            moments.variance};
    for (std::size_t h = 0; h < 14; ++h) {
      const PredictedTouches::DrawnTouch touch = predicted.draw(h, draws);
      all.insert(all.end(), {touch.mean, touch.variance, touch.log_likelihood});
    }
    return all;
  };
  const std::vector<double> best = answers();
  with_every_set_of_instructions(
      [&](const std::string& name) { EXPECT_EQ(answers(), best) << name; });
}

}  // namespace palpate::reading_mixture_test
