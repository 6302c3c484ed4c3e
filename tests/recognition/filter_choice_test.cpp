#include "recognition/filter_choice.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"

namespace palpate::filter_choice_test {

/// The bins of the shapes on a filter of the shared device.
ChosenBins chosen(const FilterOptions& filter, bool automatic = false,
                  BinWidth width = BinWidth::fine) {
  return chosen_bins(shared_device, shapes(), {filter, automatic, ""}, width);
}

PoseLattice wide_lattice() { return {.x_mm = {-1000.0, 1000.0, 1}, .y_mm = {-1000.0, 1000.0, 1}}; }

TEST(ChosenBins, AreThoseOfTheMapsWhereTheDeviceHoldsSoMany) {
  for (const FilterOptions& filter : every_filter()) {
    const BalancedLattice bins = chosen(filter).balanced;
    EXPECT_FALSE(bins.coarsened);
    const PoseLattice balanced =
        balanced_lattice(lattice_of(filter), shapes(), most_balanced_bins, BinWidth::fine).lattice;
    EXPECT_EQ(bins.lattice.x_mm.count, balanced.x_mm.count);
    EXPECT_EQ(bins.lattice.theta_rad.count, balanced.theta_rad.count);
  }
}

TEST(ChosenBins, FollowUncertainTouches) {
  const DisplacementSd sd{.mm = 2.0, .rad = 0.2};
  const auto step_mm = [](const FilterOptions& filter) {
    return chosen(filter, false, BinWidth::automatic).balanced.step_mm;
  };
  const double exact = step_mm(BoundedOptions{});
  EXPECT_GT(step_mm(BoundedOptions{.touch_sd = sd}), 1.2 * exact);
  EXPECT_EQ(step_mm(HistogramOptions{.touch_sd = sd}), step_mm(BoundedOptions{.touch_sd = sd}));
  EXPECT_EQ(step_mm(ParticleOptions{}), exact);
}

TEST(ChosenBins, AreCoarserWhereTheDeviceHoldsFewerButForBounds) {
  const HistogramOptions histogram{.lattice = wide_lattice()};
  HistogramOptions slips = histogram;
  slips.slip_sd.mm = 1.0;
  const std::int64_t held = most_bins_on(shared_device());
  const ChosenBins coarse = chosen(histogram);
  ASSERT_TRUE(coarse.balanced.coarsened);
  EXPECT_EQ(coarse.most_bins, held);
  EXPECT_LE(2 * coarse.balanced.lattice.bins(), held);
  EXPECT_GT(coarse.balanced.step_mm, balanced_step * 0.5) << "of cells of 0.5 mm";
  EXPECT_LE(chosen(slips, true).most_bins, held) << "each bin takes memory";
  for (const ChosenBins& bins :
       {chosen(BoundedOptions{.lattice = wide_lattice()}), chosen(histogram, true)}) {
    ASSERT_TRUE(bins.balanced.coarsened);
    EXPECT_EQ(bins.most_bins, most_bounded_bins);
    const std::int64_t all = bins_in_all(2, bins.balanced.lattice);
    EXPECT_LE(all, most_bounded_bins);
    EXPECT_GT(all, most_balanced_bins) << "more than any histogram gets";
  }
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

TEST(FilterForBins, IsBoundsForManyBinsThatBoundsTake) {
  const int half = most_histogram_bins / 2;
  EXPECT_FALSE(takes_bounds(histogram_of(half)));
  HistogramOptions many = histogram_of(half + 1);
  many.contact.gamma = 0.2;
  many.touch_sd.rad = 0.1;
  const auto bounded = std::get<BoundedOptions>(filter_for_bins(shapes(), many));
  EXPECT_EQ(bounded.lattice.x_mm.count, half + 1);
  EXPECT_EQ(bounded.contact.gamma, 0.2);
  EXPECT_EQ(bounded.none_weight, 0.5);
  EXPECT_EQ(bounded.tolerance, 1e-6);
  EXPECT_FALSE(bounded.budget_s);
  many.slip_sd.mm = 0.1;
  EXPECT_FALSE(takes_bounds(many));
  HistogramOptions large = histogram_of(most_histogram_bins);
  large.lattice.y_mm.count = 100'000;
  EXPECT_FALSE(takes_bounds(large)) << "too large for both; the histogram says so";
}

TEST(FilterForBins, IsBoundsForMoreBinsThanAnyHistogramHolds) {
  HistogramOptions histogram = histogram_of(1000);
  histogram.lattice.y_mm.count = 1000;
  histogram.lattice.theta_rad.count = 540;
  ASSERT_GT(bins_in_all(2, histogram.lattice), most_bounded_bins) << "which bounds have room for";
  EXPECT_TRUE(bounds_have_room(shapes(), *bounded_instead(histogram)));
  EXPECT_TRUE(takes_bounds(histogram));
}

}  // namespace palpate::filter_choice_test
