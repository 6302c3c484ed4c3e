// What is kept of bins as if touches were exact shows in no bit of the means over displacements.

#include "estimation/bounded/displaced/undisplaced_bins.hpp"

#include <array>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "support/synthetic.hpp"

namespace palpate::undisplaced_bins_test {

constexpr int width = 16;

PlaceRows<double> rows_of(std::vector<double>& values) { return {values.data(), width, 0, 0}; }

TEST(UndisplacedBins, CopyWhatTheyKeptAndNameTheOthers) {
  // Room for two or three blocks of 16 numbers.
  UndisplacedBins bins(2, 3, 400);
  std::vector<double> values(std::size_t{width} * 8);
  std::iota(values.begin(), values.end(), 1.0);
  bins.keep(1, std::array{BlockRun{.theta = 2, .y = 1, .x = 1, .count = 2}}, rows_of(values));
  std::vector<double> copied(values.size());
  const std::array asked{BlockRun{.theta = 2, .y = 1, .x = 0, .count = 4}};
  const std::vector<BlockRun> others = bins.copy(1, asked, rows_of(copied));
  ASSERT_EQ(others.size(), 2U);
  EXPECT_EQ(others[0].x, 0);
  EXPECT_EQ(others[1].x, 3);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x);
      EXPECT_EQ(copied[i], y >= 4 && x >= 4 && x < 12 ? values[i] : 0.0);
    }
  }
  EXPECT_EQ(bins.copy(0, asked, rows_of(copied)).front().count, 4) << "of another object";
  const std::size_t held = bins.bytes();
  bins.keep(0, asked, rows_of(values));
  EXPECT_LE(bins.bytes(), 400U);
  EXPECT_GE(bins.bytes(), held);
}

TEST(UndisplacedBins, ShowInNoBit) {
  const std::vector<Hypothesis> two{{random_map(17, 13, 0.5, 3.0, 871), 1.0},
                                    {random_map(15, 19, 0.5, 3.0, 872), 1.0}};
  const PoseLattice lattice{.x_mm = {-4.0, 4.0, 21}, .y_mm = {-3.0, 3.0, 18}};
  const DisplacementSd touch_sd{0.6, 0.4};
  const BinLikelihood likelihood(two, {.prior = 0.2}, lattice, touch_sd);
  const Recording recording = random_recording(1, 5, 873);
  const KnownElements alone =
      known_elements(TouchEvidence(recording.touch(0), {}), {.touch_sd = touch_sd});
  KnownElements keeping = alone;
  constexpr std::size_t few_blocks = 10'000;
  for (const std::size_t room : {few_blocks, UndisplacedBins::most_bytes}) {
    keeping.touches.front().undisplaced_bins = std::make_shared<UndisplacedBins>(
        two.size(), static_cast<std::size_t>(lattice.theta_rad.count), room);
    for (const int first : {0, 3, 0}) {
      const std::vector<BinBox> boxes{
          {.object = 0, .theta = 2, .y_first = 5, .y_count = 4, .x_first = first, .x_count = 9},
          {.object = 1, .theta = 3, .y_first = 14, .y_count = 4, .x_first = 12, .x_count = 9}};
      std::vector<double> expected(72);
      std::vector<double> got(72);
      likelihood.evaluate(boxes, alone, expected);
      likelihood.evaluate(boxes, keeping, got);
      EXPECT_EQ(got, expected);
    }
    EXPECT_GT(keeping.touches.front().undisplaced_bins->bytes(), 0U);
  }
}

}  // namespace palpate::undisplaced_bins_test
