#include "recognition_task.hpp"

#include <gtest/gtest.h>

#include "palpate/balanced_lattice.hpp"
#include "shapes.hpp"

namespace palpate {
namespace {

TEST(RecognitionTask, NamesEachLabelOnceAndNoneLast) {
  std::vector<Hypothesis> three = shapes();
  three.push_back(three[0]);
  const RecognitionTask known(three, HistogramOptions{});
  EXPECT_EQ(known.labels, (std::vector<std::string>{"L", "disc"}));
  EXPECT_EQ(known.label_of, (std::vector<std::size_t>{0, 1, 0}));
  const RecognitionTask with_none(three, HistogramOptions{.none_weight = 2.0});
  EXPECT_EQ(with_none.labels, (std::vector<std::string>{"L", "disc", "(none)"}));
}

TEST(SettleBins, CountsTheBinsOnceWhereTheyAreLeftToTheMaps) {
  const Device device = Device::open();
  for (const FilterOptions& filter : both_filters()) {
    RecognitionTask task(shapes(), filter);
    EXPECT_FALSE(settle_bins(device, task));
    EXPECT_EQ(task.lattice().x_mm.count, 20) << "as given";
    task.bin_width = BinWidth::fine;
    EXPECT_FALSE(settle_bins(device, task)) << "the device holds so many";
    const PoseLattice balanced =
        balanced_lattice(task.lattice(), task.hypotheses, most_balanced_bins, BinWidth::fine)
            .lattice;
    EXPECT_EQ(task.lattice().x_mm.count, balanced.x_mm.count);
    EXPECT_EQ(task.lattice().theta_rad.count, balanced.theta_rad.count);
    EXPECT_FALSE(task.bin_width);
  }
}

TEST(SettleBins, TellsOfBinsThatTheDeviceMadeCoarser) {
  const Device device = Device::open();
  const PoseLattice wide{.x_mm = {-1000.0, 1000.0, 1}, .y_mm = {-1000.0, 1000.0, 1}};
  RecognitionTask task(shapes(), HistogramOptions{.lattice = wide, .still_array = true});
  task.bin_width = BinWidth::fine;
  const std::optional<CoarsenedBins> bins = settle_bins(device, task);
  ASSERT_TRUE(bins);
  EXPECT_EQ(bins->most_bins, most_bins_on(device, true));
  EXPECT_LE(2 * task.lattice().bins(), bins->most_bins);
  EXPECT_GT(bins->step_mm, balanced_step * 0.5) << "of cells of 0.5 mm";
}

}  // namespace
}  // namespace palpate
