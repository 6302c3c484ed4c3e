#include "recognition/recognition_task.hpp"

#include <gtest/gtest.h>

#include "palpate/balanced_lattice.hpp"
#include "shapes.hpp"

namespace palpate::recognition_task_test {

TEST(RecognitionTask, NamesEachLabelOnceAndNoneLast) {
  std::vector<Hypothesis> three = shapes();
  three.push_back(three[0]);
  const RecognitionTask known(three, HistogramOptions{});
  EXPECT_EQ(known.labels, (std::vector<std::string>{"L", "disc"}));
  EXPECT_EQ(known.label_of, (std::vector<std::size_t>{0, 1, 0}));
  const RecognitionTask with_none(three, HistogramOptions{.none_weight = 2.0});
  EXPECT_EQ(with_none.labels, (std::vector<std::string>{"L", "disc", "(none)"}));
  const RecognitionTask bounded_with_none(three, BoundedOptions{.none_weight = 2.0});
  EXPECT_EQ(bounded_with_none.labels, with_none.labels);
}

TEST(SettleBins, CountsTheBinsOnceWhereTheyAreLeftToTheMaps) {
  const Device device = Device::open();
  for (const FilterOptions& filter : every_filter()) {
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

TEST(SettleBins, IsNotLimitedByTheDeviceWhereBoundsMayTakeTheBins) {
  const Device device = Device::open();
  const PoseLattice wide{.x_mm = {-1000.0, 1000.0, 1}, .y_mm = {-1000.0, 1000.0, 1}};
  RecognitionTask automatic(shapes(), HistogramOptions{.lattice = wide});
  automatic.auto_filter = true;
  for (RecognitionTask task :
       {RecognitionTask(shapes(), BoundedOptions{.lattice = wide}), automatic}) {
    task.bin_width = BinWidth::fine;
    const std::optional<CoarsenedBins> bins = settle_bins(device, task);
    ASSERT_TRUE(bins);
    EXPECT_EQ(bins->most_bins, most_bounded_bins);
    EXPECT_LE(task.bins_in_all(), most_bounded_bins);
    EXPECT_GT(task.bins_in_all(), most_balanced_bins) << "more than any histogram gets";
  }
  automatic.bin_width = BinWidth::fine;
  std::get<HistogramOptions>(automatic.filter).touch_sd = {.mm = 1.0};
  EXPECT_EQ(settle_bins(device, automatic)->most_bins, most_bins_on(device, false))
      << "bounds refuse touches of uncertain pose";
}

/// A task of two objects with so many bins of each, whose filter is left to the rule.
RecognitionTask automatic_task(int bins_of_each) {
  PoseLattice lattice;
  lattice.x_mm.count = bins_of_each;
  lattice.y_mm.count = 1;
  lattice.theta_rad.count = 1;
  RecognitionTask task(shapes(), HistogramOptions{.lattice = lattice, .none_weight = 0.5});
  task.auto_filter = true;
  return task;
}

TEST(SettleFilter, TakesBoundsForManyBins) {
  const int half = most_histogram_bins / 2;
  RecognitionTask few = automatic_task(half);
  EXPECT_EQ(few.bins_in_all(), most_histogram_bins);
  settle_filter(few);
  EXPECT_TRUE(std::holds_alternative<HistogramOptions>(few.filter));

  RecognitionTask many = automatic_task(half + 1);
  std::get<HistogramOptions>(many.filter).contact.gamma = 0.2;
  settle_filter(many);
  const auto* bounded = std::get_if<BoundedOptions>(&many.filter);
  ASSERT_NE(bounded, nullptr);
  EXPECT_EQ(bounded->lattice.x_mm.count, half + 1);
  EXPECT_EQ(bounded->contact.gamma, 0.2);
  EXPECT_EQ(bounded->none_weight, 0.5);
  EXPECT_EQ(bounded->tolerance, 1e-6);
  EXPECT_FALSE(bounded->budget_s);
}

TEST(SettleFilter, TakesBoundsForMoreBinsThanAnyHistogramHolds) {
  RecognitionTask task = automatic_task(1000);
  task.lattice().y_mm.count = 1000;
  task.lattice().theta_rad.count = 540;
  ASSERT_GT(task.bins_in_all(), most_bounded_bins) << "which bounds have room for";
  EXPECT_TRUE(bounds_have_room(task));
  settle_filter(task);
  EXPECT_TRUE(std::holds_alternative<BoundedOptions>(task.filter));
}

TEST(SettleFilter, TakesTheHistogramForWhatBoundsRefuse) {
  const auto kept = [](const auto& change) {
    RecognitionTask task = automatic_task(most_histogram_bins);
    change(task, std::get<HistogramOptions>(task.filter));
    settle_filter(task);
    return std::holds_alternative<HistogramOptions>(task.filter);
  };
  using Task = RecognitionTask;
  EXPECT_FALSE(kept([](Task&, HistogramOptions&) {}));
  EXPECT_FALSE(kept([](Task&, HistogramOptions& options) { options.still_array = true; }))
      << "the rule is the same for a still array";
  EXPECT_TRUE(kept([](Task& task, HistogramOptions&) { task.auto_filter = false; }));
  EXPECT_TRUE(kept([](Task&, HistogramOptions& options) { options.lattice.y_mm.count = 100'000; }))
      << "too large for both; the histogram says so";
  EXPECT_TRUE(kept([](Task&, HistogramOptions& options) { options.touch_sd.rad = 0.1; }));
  EXPECT_TRUE(kept([](Task&, HistogramOptions& options) { options.slip_sd.mm = 0.1; }));
  EXPECT_TRUE(kept([](Task&, HistogramOptions& options) { options.memory_limit_bytes = 1; }));
}

TEST(RecognitionTask, CountsBinsBeyondEveryInteger) {
  RecognitionTask task = automatic_task(2'000'000'000);
  task.lattice().y_mm.count = 2'000'000'000;
  task.lattice().theta_rad.count = 2'000'000'000;
  EXPECT_GT(task.bins_in_all(), 1'000'000'000'000'000'000);
}

}  // namespace palpate::recognition_task_test
