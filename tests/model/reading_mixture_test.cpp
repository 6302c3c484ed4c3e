#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/mixture_kernel.hpp"
#include "model/reading_mixture.hpp"
#include "palpate/fit.hpp"
#include "palpate/touch.hpp"
#include "support/every_set_of_instructions.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::reading_mixture_test {

/// What the functions give for one set of instructions, or for the machine's best.
struct Answers {
  std::vector<double> sums = std::vector<double>(16);
  double log_sum = 0.0;
  std::vector<double> probability = std::vector<double>(3 * 16);
  std::vector<double> mean = std::vector<double>(16, 0.5);
  std::vector<double> variance = std::vector<double>(16, 0.25);

  bool operator==(const Answers&) const = default;
};

/// A number within (-4, 0], another one for every i.
double log_at(std::size_t i) {
  return -4.0 * std::abs(std::sin(1.0 + 0.7 * static_cast<double>(i)));
}

Answers answers() {
  Answers all;
  std::vector<double> logs(3 * 16);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    logs[i] = log_at(i);
  }
  const double* const rows[] = {logs.data() + 16, logs.data(), logs.data() + 32};
  sum_rows(rows, all.sums);
  std::vector<double> values(logs.begin(), logs.begin() + 16);
  values[14] = values[15] = -infinity;
  all.log_sum = log_sum_exp(values);
  predict_element(
      {.log_likelihood = logs.data(), .probability = all.probability.data(), .levels = 3}, all.mean,
      all.variance);
  return all;
}

TEST(MixtureKernel, IsWithinItsTolerance) {
  const Answers found = answers();
  double sum = 0.0;
  for (std::size_t h = 0; h < 16; ++h) {
    EXPECT_EQ(found.sums[h], log_at(16 + h) + log_at(h) + log_at(32 + h));
    sum += h < 14 ? std::exp(log_at(h)) : 0.0;
    double total = 0.0;
    for (std::size_t level = 0; level < 3; ++level) {
      total += std::exp(log_at(16 * level + h));
    }
    double mean = 0.0;
    double squares = 0.0;
    for (std::size_t level = 0; level < 3; ++level) {
      const double l = log_at(16 * level + h);
      const double q = std::exp(l) / total;
      EXPECT_NEAR(found.probability[16 * level + h], q, 1e-12);
      mean += q * l;
      squares += q * l * l;
    }
    EXPECT_NEAR(found.mean[h], 0.5 + mean, 1e-12);
    EXPECT_NEAR(found.variance[h], 0.25 + squares - mean * mean, 1e-11);
  }
  EXPECT_NEAR(found.log_sum, std::log(sum), 1e-12);
}

TEST(MixtureKernel, StaysInRange) {
  std::vector<double> values(8, -infinity);
  values[3] = -5000.0;
  EXPECT_EQ(log_sum_exp(values), -5000.0);
  values[4] = -1e30;
  EXPECT_EQ(log_sum_exp(values), -5000.0);
}

TEST(MixtureKernel, EverySetOfInstructionsGivesTheSameBits) {
  const Answers best = answers();
  with_every_set_of_instructions(
      [&](const std::string& name) { EXPECT_EQ(answers(), best) << name; });
}

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

void set(ReadingMixture& mixture, std::size_t hypothesis, const std::vector<double>& logs) {
  mixture.set(hypothesis, std::span(logs));
}

ReadingMixture two_hypotheses() {
  ReadingMixture mixture(2, 2, 2);
  set(mixture, 0, logs_of({0.9, 0.2}));
  set(mixture, 1, logs_of({0.5, 0.5}));
  return mixture;
}

constexpr double rounding = 1e-12;

TEST(ReadingMixture, AveragesLikelihoods) {
  const ReadingMixture mixture = two_hypotheses();
  EXPECT_NEAR(mixture.log_mean(std::vector{yes, no}), std::log((0.9 * 0.8 + 0.25) / 2.0), rounding);
  EXPECT_NEAR(mixture.log_mean(std::vector{no, yes}), std::log((0.1 * 0.2 + 0.25) / 2.0), rounding);
  EXPECT_NEAR(mixture.log_mean(std::vector{yes, no}, 1), std::log(0.9 * 0.8), rounding);
  EXPECT_NEAR(mixture.log_mean(std::vector{yes, no}, 0), std::log(0.25), rounding);
}

TEST(ReadingMixture, StaysInRange) {
  ReadingMixture mixture(2, 1, 2);
  set(mixture, 0, std::vector{-5000.0, -2000.0});
  set(mixture, 1, std::vector{-5001.0, -1e30});
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
    EXPECT_NEAR(touch.log_likelihood, mixture.log_mean(touch.readings, 1), rounding);
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
    set(mixture, h, logs_of({0.7, 0.01, 1e-6}));
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

TEST(ReadingMixture, PredictsTheMomentsOfItsOwnTouches) {
  ReadingMixture mixture(64, 12, 2);
  Random random(3, Stream::readings);
  for (std::size_t h = 0; h < 64; ++h) {
    std::vector<double> contact;
    for (int e = 0; e < 12; ++e) {
      contact.push_back(random.uniform(0.02, 0.98));
    }
    set(mixture, h, logs_of(contact));
  }
  const Moments predicted = predicted_log_mean(mixture, mixture, random);
  const PredictedTouches touches(mixture);
  constexpr int draws = 6400;
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < draws; ++i) {
    const double judged = mixture.log_mean(touches.draw(i % 64, random).readings, i % 64);
    const double out = (judged - predicted.mean) / std::sqrt(predicted.variance);
    sum += out;
    squares += out * out;
  }
  // The prediction is from 64 touches: four standard errors, of the variance with a kurtosis of 5.
  EXPECT_NEAR(sum / draws, 0.0, 4.0 / 8.0);
  EXPECT_NEAR(squares / draws, 1.0, 4.0 * 2.0 / 8.0);
}

}  // namespace palpate::reading_mixture_test
