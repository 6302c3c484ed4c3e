#include "recognition/filter_choice.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"

namespace palpate::filter_choice_test {

/// The bins of the shapes on a filter.
ChosenBins chosen(Device& device, const FilterOptions& filter, bool automatic = false,
                  BinWidth width = BinWidth::fine) {
  return chosen_bins([&]() -> Device& { return device; }, shapes(), {filter, automatic, ""}, width);
}

PoseLattice wide_lattice() { return {.x_mm = {-1000.0, 1000.0, 1}, .y_mm = {-1000.0, 1000.0, 1}}; }

TEST(ChosenBins, AreThoseOfTheMapsWhereTheDeviceHoldsSoMany) {
  Device device = Device::open();
  for (const FilterOptions& filter : every_filter()) {
    const ChosenBins bins = chosen(device, filter);
    EXPECT_FALSE(bins.balanced.coarsened);
    const PoseLattice balanced =
        balanced_lattice(lattice_of(filter), shapes(), most_balanced_bins, BinWidth::fine).lattice;
    EXPECT_EQ(bins.balanced.lattice.x_mm.count, balanced.x_mm.count);
    EXPECT_EQ(bins.balanced.lattice.theta_rad.count, balanced.theta_rad.count);
  }
}

TEST(ChosenBins, FollowUncertainTouches) {
  Device device = Device::open();
  const DisplacementSd sd{.mm = 2.0, .rad = 0.2};
  const auto step_mm = [&](const FilterOptions& filter) {
    return chosen(device, filter, false, BinWidth::automatic).balanced.step_mm;
  };
  const double exact = step_mm(BoundedOptions{});
  EXPECT_GT(step_mm(BoundedOptions{.touch_sd = sd}), 1.2 * exact);
  EXPECT_EQ(step_mm(HistogramOptions{.touch_sd = sd}), step_mm(BoundedOptions{.touch_sd = sd}));
  EXPECT_EQ(step_mm(ParticleOptions{}), exact);
}

TEST(ChosenBins, AreCoarserWhereTheDeviceHoldsFewer) {
  Device device = Device::open();
  const ChosenBins bins = chosen(device, HistogramOptions{.lattice = wide_lattice()});
  ASSERT_TRUE(bins.balanced.coarsened);
  EXPECT_EQ(bins.most_bins, most_bins_on(device));
  EXPECT_LE(2 * bins.balanced.lattice.bins(), bins.most_bins);
  EXPECT_GT(bins.balanced.step_mm, balanced_step * 0.5) << "of cells of 0.5 mm";
}

TEST(ChosenBins, AreNotLimitedByTheDeviceWhereBoundsMayTakeThem) {
  Device device = Device::open();
  HistogramOptions histogram{.lattice = wide_lattice()};
  for (const ChosenBins& bins : {chosen(device, BoundedOptions{.lattice = wide_lattice()}),
                                 chosen(device, histogram, true)}) {
    ASSERT_TRUE(bins.balanced.coarsened);
    EXPECT_EQ(bins.most_bins, most_bounded_bins);
    const std::int64_t all = bins_in_all(2, bins.balanced.lattice);
    EXPECT_LE(all, most_bounded_bins);
    EXPECT_GT(all, most_balanced_bins) << "more than any histogram gets";
  }
  HistogramOptions slips = histogram;
  slips.slip_sd.mm = 1.0;
  EXPECT_LE(chosen(device, slips, true).most_bins, most_bins_on(device)) << "each bin takes memory";
}

/// A histogram of so many bins of each object.
HistogramOptions histogram_of(int bins) {
  HistogramOptions histogram{.none_weight = 0.5};
  histogram.lattice.x_mm.count = bins;
  histogram.lattice.y_mm.count = 1;
  histogram.lattice.theta_rad.count = 1;
  return histogram;
}

bool takes_bounds(const HistogramOptions& histogram) {
  return traits_of(filter_for_bins(shapes(), histogram)).certificate;
}

TEST(FilterForBins, IsBoundsForManyBins) {
  const int half = most_histogram_bins / 2;
  EXPECT_FALSE(takes_bounds(histogram_of(half)));
  HistogramOptions many = histogram_of(half + 1);
  many.contact.gamma = 0.2;
  const FilterOptions filter = filter_for_bins(shapes(), many);
  const auto* bounded = std::get_if<BoundedOptions>(&filter);
  ASSERT_NE(bounded, nullptr);
  EXPECT_EQ(bounded->lattice.x_mm.count, half + 1);
  EXPECT_EQ(bounded->contact.gamma, 0.2);
  EXPECT_EQ(bounded->none_weight, 0.5);
  EXPECT_EQ(bounded->tolerance, 1e-6);
  EXPECT_FALSE(bounded->budget_s);
}

TEST(FilterForBins, IsBoundsForMoreBinsThanAnyHistogramHolds) {
  HistogramOptions histogram = histogram_of(1000);
  histogram.lattice.y_mm.count = 1000;
  histogram.lattice.theta_rad.count = 540;
  ASSERT_GT(bins_in_all(2, histogram.lattice), most_bounded_bins) << "which bounds have room for";
  EXPECT_TRUE(bounds_have_room(shapes(), *bounded_instead(histogram)));
  EXPECT_TRUE(takes_bounds(histogram));
}

TEST(FilterForBins, IsTheHistogramForWhatBoundsRefuse) {
  const auto takes = [](const auto& change) {
    HistogramOptions histogram = histogram_of(most_histogram_bins);
    change(histogram);
    return takes_bounds(histogram);
  };
  using Options = HistogramOptions;
  EXPECT_TRUE(takes([](Options&) {}));
  EXPECT_FALSE(takes([](Options& options) { options.lattice.y_mm.count = 100'000; }))
      << "too large for both; the histogram says so";
  EXPECT_TRUE(takes([](Options& options) { options.touch_sd.rad = 0.1; }));
  EXPECT_FALSE(takes([](Options& options) { options.slip_sd.mm = 0.1; }));
}

}  // namespace palpate::filter_choice_test
