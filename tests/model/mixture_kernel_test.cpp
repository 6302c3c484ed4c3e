#include "model/mixture_kernel.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/every_set_of_instructions.hpp"
#include "support/limits.hpp"

namespace palpate::mixture_kernel_test {

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

}  // namespace palpate::mixture_kernel_test
