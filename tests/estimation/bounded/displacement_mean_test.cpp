// Means over displacements against the reference, and their bounds over tiles; what is kept of bins
// as if touches were exact shows in no bit of them.

#include "estimation/bounded/displaced/displacement_mean.hpp"

#include <algorithm>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::displacement_mean_test {

PoseLattice lattice_of(int nx, int ny, int thetas, double turn = two_pi) {
  return {.x_mm = {-5.0, 6.0, nx},
          .y_mm = {-4.0, 4.0, ny},
          .theta_rad = {0.3, 0.3 + turn, thetas},
          .pivot_mm = {2.0, -1.0}};
}

/// A lattice, displacements and the place of the sensor.
struct Case {
  PoseLattice lattice;
  DisplacementSd sd;
  glm::dvec2 sensor_mm;
  double spread_nats;  ///< of the log-likelihoods

  /// Some thetas are far less likely than others.
  std::vector<double> random_logs(std::uint64_t seed) const {
    Uniform random(seed);
    std::vector<double> logs;
    for (int theta = 0; theta < lattice.theta_rad.count; ++theta) {
      const double of_theta = random(-spread_nats, 0.0);
      for (std::int64_t bin = 0; bin < lattice.plane(); ++bin) {
        logs.push_back(of_theta + random(-spread_nats, 0.0));
      }
    }
    return logs;
  }
};

const Case cases[] = {{lattice_of(11, 9, 12), {1.0, 0.2}, {3.0, 4.0}, 3.0},
                      {lattice_of(11, 9, 12), {1.0, 0.2}, {3.0, 4.0}, 60.0},
                      {lattice_of(13, 7, 9, 1.5), {0.7, 0.1}, {-20.0, 9.0}, 20.0},
                      {lattice_of(1, 9, 12), {1.0, 0.4}, {3.0, 4.0}, 10.0},
                      {lattice_of(11, 1, 1), {2.5, 0.4}, {3.0, 4.0}, 10.0},
                      {lattice_of(6, 5, 20), {0.0, 0.5}, {2.0, 5.0}, 10.0},
                      {lattice_of(6, 5, 20), {3.0, 0.0}, {90.0, 5.0}, 10.0},
                      {lattice_of(18, 19, 5), {6.0, 2.0}, {2.5, -0.5}, 30.0},
                      // Beyond what float64 holds.
                      {lattice_of(7, 8, 6), {0.6, 0.3}, {3.0, 4.0}, 4000.0}};

/// All blocks of tiles of so many bins along each axis, and a few of them.
std::vector<std::vector<BlockRun>> all_blocks_and_few(const PoseLattice& lattice, int bins) {
  const auto blocks = [&](const Axis& axis) { return (axis.count + 4 * bins - 1) / (4 * bins); };
  std::vector<BlockRun> all;
  for (int theta = 0; theta < lattice.theta_rad.count; ++theta) {
    for (int y = 0; y < blocks(lattice.y_mm); ++y) {
      all.push_back({theta, y, 0, blocks(lattice.x_mm)});
    }
  }
  return {all, {all.front(), all[all.size() / 2], all.back()}};
}

/// Calls visit(bin, x, y, place of its tile's result) for every bin of some runs' tiles.
template <typename Visit>
void for_bins(std::span<const BlockRun> runs, const PoseLattice& lattice, int bins,
              const Visit& visit) {
  std::size_t first = 0;
  for (const BlockRun& run : runs) {
    for (int i = 0; i < 16 * run.count; ++i) {
      const int x_first = bins * (4 * (run.x + i / 16) + i % 4);
      const int y_first = bins * (4 * run.y + i % 16 / 4);
      for (int y = y_first; y < std::min(y_first + bins, lattice.y_mm.count); ++y) {
        for (int x = x_first; x < std::min(x_first + bins, lattice.x_mm.count); ++x) {
          const int bin = (run.theta * lattice.y_mm.count + y) * lattice.x_mm.count + x;
          visit(static_cast<std::size_t>(bin), x, y, first + static_cast<std::size_t>(i));
        }
      }
    }
    first += 16 * static_cast<std::size_t>(run.count);
  }
}

/// Sets each tile's likelihood to that of its best bin.
template <typename Value>
PlaceSource<Value> source_of(const std::vector<double>& logs, const PoseLattice& lattice,
                             int bins) {
  return [&logs, lattice, bins](std::span<const BlockRun> runs, const PlaceRows<Value>& rows) {
    for_bins(runs, lattice, bins, [&](std::size_t bin, int x, int y, std::size_t /*place*/) {
      Value& of_tile = *rows.at(x / bins, y / bins);
      of_tile = std::max(of_tile, static_cast<Value>(logs[bin]));
    });
  };
}

TEST(DisplacementMean, IsTheReferencesAndBoundedOverTiles) {
  std::uint64_t seed = 941;
  for (const Case& c : cases) {
    const DisplacementWeights weights(c.lattice, c.sd);
    const glm::dvec2 from_pivot_mm = c.sensor_mm - c.lattice.pivot_mm;
    for (const int bins : {1, 2, 4, 16}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << ", tiles of " << bins);
      const std::vector<double> logs = c.random_logs(seed++);
      const std::vector<double> expected =
          reference::displaced_touch(logs, c.lattice, c.sd, {c.sensor_mm, 0.4});
      const DisplacementMean mean(weights, bins);
      double closest = infinity;
      for (const std::vector<BlockRun>& asked : all_blocks_and_few(c.lattice, bins)) {
        const std::vector<double> bounds =
            mean.bounds(from_pivot_mm, asked, source_of<float>(logs, c.lattice, bins));
        std::vector<double> means;
        if (bins == 1) {
          means = mean.means(from_pivot_mm, asked, source_of<double>(logs, c.lattice, 1));
        }
        for_bins(asked, c.lattice, bins, [&](std::size_t bin, int, int, std::size_t place) {
          // float32 keeps seven digits of the logs.
          EXPECT_GE(bounds[place], expected[bin] - 1e-6 * c.spread_nats) << "bin " << bin;
          closest = std::min(closest, bounds[place] - expected[bin]);
          if (bins == 1) {
            // Logs of some thousand nats keep 16 digits.
            EXPECT_NEAR(means[place], expected[bin], 1e-11 + mean.mean_error()) << "bin " << bin;
          }
        });
      }
      EXPECT_LT(closest, bins == 1 ? 0.01 : infinity) << "no closer over any bin";
    }
  }
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
    std::set<std::size_t> kept;
    for (const int first : {0, 3, 0}) {
      const std::vector<BinBox> boxes{
          {.object = 0, .theta = 2, .y_first = 5, .y_count = 4, .x_first = first, .x_count = 9},
          {.object = 1, .theta = 2, .y_first = 7, .y_count = 4, .x_first = 6, .x_count = 9}};
      std::vector<double> expected(72);
      std::vector<double> got(72);
      likelihood.evaluate(boxes, alone, expected);
      likelihood.evaluate(boxes, keeping, got);
      EXPECT_EQ(got, expected);
      kept.insert(keeping.touches.front().undisplaced_bins->bytes());
    }
    EXPECT_EQ(kept.size(), 1U) << "all lie in the first boxes' blocks, which are kept once";
    EXPECT_GT(*kept.begin(), 0U);
    EXPECT_LE(*kept.rbegin(), room);
  }
}

}  // namespace palpate::displacement_mean_test
