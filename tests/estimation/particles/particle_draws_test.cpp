#include "estimation/particles/particle_draws.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "support/synthetic.hpp"

namespace palpate::particle_draws_test {

/// Blocks whose largest weights differ by orders.
std::vector<shaders::WeightBlock> random_blocks(std::size_t count, std::uint64_t seed) {
  Uniform random(seed);
  std::vector<shaders::WeightBlock> blocks;
  for (std::size_t i = 0; i < count; ++i) {
    const auto sum = static_cast<float>(random(1.0, 1024.0));
    blocks.push_back({.max_high = static_cast<float>(random(-1000.0, -990.0)),
                      .max_low = static_cast<float>(random(-3e-5, 3e-5)),
                      .sum = sum,
                      .sum_squares = sum * static_cast<float>(random(0.1, 1.0))});
  }
  return blocks;
}

/// The share of every block in all weights.
std::vector<double> shares(const std::vector<shaders::WeightBlock>& blocks) {
  std::vector<double> share;
  double total = 0.0;
  for (const shaders::WeightBlock& block : blocks) {
    share.push_back(block.sum *
                    std::exp(static_cast<double>(block.max_high) + block.max_low + 990.0));
    total += share.back();
  }
  for (double& s : share) {
    s /= total;
  }
  return share;
}

TEST(WeightBlocks, AreSummedRelativeToTheLargestOfAll) {
  const std::vector<shaders::WeightBlock> blocks = {
      {.max_high = -2000.0F, .max_low = 0.0F, .sum = 3.0F, .sum_squares = 2.0F},
      {.max_high = -2001.0F, .max_low = 0.0F, .sum = 4.0F, .sum_squares = 3.0F},
      {.max_high = -9000.0F, .max_low = 0.0F, .sum = 5.0F, .sum_squares = 5.0F}};
  const WeightSummary summary = summarise(blocks);
  EXPECT_EQ(summary.log_largest, -2000.0);
  EXPECT_DOUBLE_EQ(summary.sum, 3.0 + 4.0 * std::exp(-1.0));
  EXPECT_DOUBLE_EQ(summary.sum_squares, 2.0 + 3.0 * std::exp(-2.0));
  EXPECT_DOUBLE_EQ(summary.effective_sample_size(),
                   summary.sum * summary.sum / summary.sum_squares);
}

TEST(WeightBlocks, TakeRandomWordsByTheirShare) {
  const std::vector<shaders::WeightBlock> blocks = random_blocks(50, 411);
  const std::vector<shaders::DrawBlock> draw = multinomial_blocks(blocks, summarise(blocks));
  const std::vector<double> expected = shares(blocks);
  ASSERT_EQ(draw.size(), blocks.size());
  double begin = 0.0;
  for (std::size_t i = 0; i < draw.size(); ++i) {
    // Both bounds are whole words.
    EXPECT_NEAR((draw[i].key_end - begin) * 0x1p-32, expected[i], 3 * 0x1p-32) << i;
    begin = draw[i].key_end;
  }
}

TEST(WeightBlocks, TakeEvenStepsThroughTheSum) {
  const std::vector<shaders::WeightBlock> blocks = random_blocks(50, 412);
  const WeightSummary summary = summarise(blocks);
  const std::vector<double> expected = shares(blocks);
  constexpr int draws = 50 * 1024;
  for (const double offset : {0.0, 0.37, 0.999999}) {
    const std::vector<shaders::DrawBlock> draw = systematic_blocks(blocks, summary, draws, offset);
    double before = 0.0;
    std::uint32_t begin = 0;
    for (std::size_t i = 0; i < draw.size(); ++i) {
      EXPECT_NEAR(draw[i].key_end - begin, draws * expected[i], 1.0 + 1e-6) << i;
      if (draw[i].key_end > begin) {
        // Where the last key falls: float32 of a place within the block.
        const double place = (draw[i].key_end - 1 + offset) / draws;
        EXPECT_NEAR(draw[i].last / blocks[i].sum, (place - before) / expected[i], 1e-6) << i;
        EXPECT_NEAR(draw[i].step / blocks[i].sum, 1.0 / draws / expected[i],
                    1e-6 / draws / expected[i]);
      }
      before += expected[i];
      begin = draw[i].key_end;
    }
    EXPECT_EQ(begin, draws);
  }
}

TEST(WeightBlocks, OfNoWeightAreNeverDrawnFrom) {
  std::vector<shaders::WeightBlock> blocks(
      5, {.max_high = -5000.0F, .max_low = 0.0F, .sum = 1024.0F, .sum_squares = 1024.0F});
  blocks[2].max_high = 0.0F;
  const WeightSummary summary = summarise(blocks);
  // The last block takes what lies beyond all bounds, so it must be the one of weight.
  const auto expect_third_only = [](const std::vector<shaders::DrawBlock>& draw) {
    ASSERT_EQ(draw.size(), 3U);
    EXPECT_EQ(draw[0].key_end, 0U);
    EXPECT_EQ(draw[1].key_end, 0U);
  };
  expect_third_only(multinomial_blocks(blocks, summary));
  const auto systematic = systematic_blocks(blocks, summary, 5 * 1024, 0.5);
  expect_third_only(systematic);
  EXPECT_EQ(systematic.back().key_end, 5U * 1024U);
  // (5119 + 1/2) / 5120 of the block's 1024.
  EXPECT_FLOAT_EQ(systematic.back().last, 1024.0F * (1.0F - 0.5F / 5120.0F));
}

TEST(LikelihoodAverages, InjectWhereTheFastFallsBelowTheSlow) {
  LikelihoodAverages averages(0.1, 0.5);
  EXPECT_EQ(averages.injected(), 0.0) << "nothing is known yet";
  // exp(-1) and exp(-2) per element, from touches of 36 and 10: the number does not matter.
  averages.add(-36.0, 36);
  EXPECT_EQ(averages.injected(), 0.0) << "both start at the first touch";
  averages.add(-20.0, 10);
  const double a = std::exp(-1.0);
  const double b = std::exp(-2.0);
  EXPECT_NEAR(averages.injected(), 1.0 - (a + 0.5 * (b - a)) / (a + 0.1 * (b - a)), 1e-15)
      << "rounding";
  averages.add(-3.0, 30);
  EXPECT_EQ(averages.injected(), 0.0) << "the fast one is above the slow one again";
}

TEST(LikelihoodAverages, StandAThousandElementsAndATouchOfNoLikelihood) {
  LikelihoodAverages averages(0.1, 0.5);
  averages.add(-2000.0, 1000);  // exp(-2000) is 0 in float64
  averages.add(-4000.0, 1000);
  EXPECT_GT(averages.injected(), 0.1);
  EXPECT_LT(averages.injected(), 1.0);
  LikelihoodAverages none(0.1, 0.5);
  none.add(-1e6, 1);
  EXPECT_EQ(none.injected(), 0.0) << "0 / 0";
}

}  // namespace palpate::particle_draws_test
