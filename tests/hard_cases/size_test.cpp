
#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::size_test {

HistogramOptions small_options() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 6}, .y_mm = {-5.0, 5.0, 5}, .theta_rad = {0, two_pi, 4}};
  return options;
}

TEST(Size, OneObjectOneBinOneElement) {
  HardCase hard("one object, one bin, one element",
                "reductions and tiles whose width exceeds what there is",
                "the element's logarithm alone; identity and marginals are 1");
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 451), 1e-30}};
  Device device = Device::open();
  for (const double half_mm : {0.0, 2.0}) {
    HistogramOptions options;
    options.lattice = {
        .x_mm = {-half_mm, half_mm, 1}, .y_mm = {0.3, 0.3, 1}, .theta_rad = {1, 1, 1}};
    for (const double gamma : {0.1, 0.0}) {
      options.contact.gamma = gamma;
      const Recording recording = random_recording(1, 1, 452);
      const Estimate estimate =
          hard.expect_posterior(device, objects, options, all_touches(recording), {1e-5});
      EXPECT_EQ(estimate.identity, std::vector{1.0});
      EXPECT_EQ(estimate.mode.bin, 0);
    }
  }
}

TEST(Size, AMapOfOneCell) {
  HardCase hard("a map of one cell", "interpolation reaches beyond the map on both sides",
                "a border of prior, wider than any tile reaches");
  const std::vector<Hypothesis> objects{{random_map(1, 1, 0.5, 6.0, 453), 1.0},
                                        {random_map(1, 1, 8.0, 6.0, 454), 1.0},
                                        {random_map(1, 9, 1.0, 6.0, 455), 1.0}};
  const Recording recording = random_recording(4, 36, 456);
  Device device = Device::open();
  hard.expect_posterior(device, objects, small_options(), all_touches(recording));
}

TEST(Size, CellsOfTwoHundredthsOfAMillimetre) {
  HardCase hard("map cells of 0.02 mm", "a bin's step spans 80 cells, places need 1e-6 mm",
                "cell and fraction: 6e-8 of a cell times its slope of 24 nats");
  const std::vector<Hypothesis> objects{{random_map(501, 501, 0.02, 12.0, 457), 1.0}};
  const Recording recording = random_recording(4, 36, 458);
  HistogramOptions options = small_options();
  Device device = Device::open();
  hard.expect_posterior(device, objects, options, all_touches(recording));
  // Bins of 4 um are finer than even these cells.
  options.lattice.x_mm = {0.0, 0.04, 10};
  options.lattice.y_mm = {0.0, 0.04, 10};
  hard.expect_posterior(device, objects, options, all_touches(recording));
}

TEST(Size, CellsOfAHundredMillimetres) {
  HardCase hard("map cells of 100 mm",
                "the whole array lies in one cell, a bin's step is 0.001 of it",
                "cell and fraction: 6e-8 of a cell, 6e-6 mm");
  const std::vector<Hypothesis> objects{{random_map(5, 4, 100.0, 12.0, 459), 1.0}};
  const Recording recording = random_recording(4, 36, 460);
  HistogramOptions options = small_options();
  Device device = Device::open();
  hard.expect_posterior(device, objects, options, all_touches(recording));
  options.lattice.x_mm = {-0.3, 0.3, 6};
  options.lattice.y_mm = {-200.0, 300.0, 5};
  hard.expect_posterior(device, objects, options, all_touches(recording));
}

TEST(Size, FourThousandElements) {
  HardCase hard("an array of 4,096 elements",
                "tables, segments and kernel loops longer than one batch",
                "each logarithm of eight factors to some 1e-7 nats: 1e-4 nats per 36 elements");
  const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 6.0, 461), 1.0},
                                        {random_map(31, 31, 1.0, 6.0, 462), 1.0}};
  // 1,024 logarithms per bin with errors of some 1e-7 nats each: 4.7e-4 and 3.5e-5 nats are seen.
  constexpr Allowed per_36{.nats = 4e-3, .near_top_nats = 3e-4};
  const Recording recording = random_recording(2, 4096, 463);
  Device device = Device::open();
  hard.expect_posterior(device, objects, small_options(), all_touches(recording), per_36);
  hard.expect_map(device, recording.touches(0, 1), {.cell_mm = 1.0});
}

}  // namespace palpate::size_test
