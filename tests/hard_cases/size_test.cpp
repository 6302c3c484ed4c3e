// Objects, lattices, cells and arrays of the least and of the largest sizes.

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::size_test {

TEST(Size, OneObjectOneBinOneElement) {
  HardCase hard("one object, one bin, one element");
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 451), 1e-30}};
  const Recording recording = random_recording(1, 1, 452);
  for (const double half_mm : {0.0, 2.0}) {
    HistogramOptions options;
    options.lattice = {
        .x_mm = {-half_mm, half_mm, 1}, .y_mm = {0.3, 0.3, 1}, .theta_rad = {1, 1, 1}};
    for (const double gamma : {0.1, 0.0}) {
      options.contact.gamma = gamma;
      const Estimate estimate =
          hard.expect_posterior(objects, options, all_touches(recording), {1e-5});
      EXPECT_EQ(estimate.identity, std::vector{1.0});
      EXPECT_EQ(estimate.mode.bin, 0);
    }
  }
}

TEST(Size, FewBinsByBounds) {
  HardCase hard("bounds: one bin, one theta, one row and one column");
  const std::vector<Hypothesis> objects = two_objects(6.0, 854);
  const Recording recording = random_recording(4, 24, 856);
  const Axis x{-5.0, 5.0, 9};
  const Axis theta{0.0, two_pi, 7};
  const Axis at{0.3, 0.3, 1};
  const Axis wide{-2.0, 2.0, 1};
  for (const PoseLattice& lattice : {PoseLattice{.x_mm = at, .y_mm = at, .theta_rad = at},
                                     PoseLattice{.x_mm = wide, .y_mm = wide, .theta_rad = wide},
                                     PoseLattice{.x_mm = x, .y_mm = x, .theta_rad = at},
                                     PoseLattice{.x_mm = x, .y_mm = at, .theta_rad = theta},
                                     PoseLattice{.x_mm = at, .y_mm = x, .theta_rad = theta},
                                     PoseLattice{.x_mm = at, .y_mm = at, .theta_rad = theta}}) {
    BoundedOptions options{.lattice = lattice};
    hard.expect_laws(objects, options, recording);
    options.contact.gamma = 0.0;
    const Certified seen = hard.expect_laws(std::span(objects).first(1), options, recording);
    EXPECT_EQ(seen.estimate.identity, std::vector{1.0});
  }
}

TEST(Size, AMapOfOneCell) {
  HardCase hard("a map of one cell");
  const std::vector<Hypothesis> objects{{random_map(1, 1, 0.5, 6.0, 453), 1.0},
                                        {random_map(1, 1, 8.0, 6.0, 454), 1.0},
                                        {random_map(1, 9, 1.0, 6.0, 455), 1.0}};
  const Recording recording = random_recording(4, 36, 456);
  hard.expect_posterior(objects, small_options(), all_touches(recording));
}

TEST(Size, CellsOfTwoHundredthsOfAMillimetre) {
  HardCase hard("map cells of 0.02 mm");
  HardCase bounds("bounds: map cells of 0.02 mm, bins of 1 mm and of 4 um");
  const std::vector<Hypothesis> objects{{random_map(251, 241, 0.02, 12.0, 457), 1.0},
                                        {random_map(31, 27, 0.5, 6.0, 843), 1.0}};
  const Recording recording = random_recording(4, 36, 458);
  HistogramOptions options = small_options();
  for (const Axis& axis : {Axis{-5.0, 5.0, 6}, Axis{0.0, 0.04, 10}}) {
    options.lattice.x_mm = options.lattice.y_mm = axis;
    hard.expect_posterior(objects, options, all_touches(recording));
    // 1e-14 mm of a place are 5e-13 cells of 24 nats.
    bounds.expect_laws(objects, options, recording, 1e-8);
  }
}

TEST(Size, CellsOfAHundredMillimetres) {
  HardCase hard("map cells of 100 mm");
  HardCase bounds("bounds: map cells of 100 mm");
  const std::vector<Hypothesis> objects{{random_map(5, 4, 100.0, 12.0, 459), 1.0},
                                        {random_map(7, 6, 80.0, 6.0, 846), 1.0}};
  const Recording recording = random_recording(4, 36, 460);
  HistogramOptions options = small_options();
  for (const auto& [x_mm, y_mm] : {std::pair(options.lattice.x_mm, options.lattice.y_mm),
                                   {Axis{-0.3, 0.3, 6}, Axis{-200.0, 300.0, 5}}}) {
    options.lattice.x_mm = x_mm;
    options.lattice.y_mm = y_mm;
    hard.expect_posterior(objects, options, all_touches(recording));
    bounds.expect_laws(objects, options, recording);
  }
}

TEST(Size, FourThousandElements) {
  HardCase hard("an array of 4,096 elements");
  HardCase bounds("bounds: an array of 4,096 elements");
  const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 6.0, 461), 1.0},
                                        {random_map(31, 31, 1.0, 6.0, 462), 1.0}};
  // 1,024 logarithms per bin with errors of some 1e-7 nats each: 4.7e-4 and 3.5e-5 nats are seen.
  constexpr Allowed per_36{.nats = 4e-3, .near_top_nats = 3e-4};
  const Recording recording = random_recording(2, 4096, 463);
  hard.expect_posterior(objects, small_options(), all_touches(recording), per_36);
  hard.expect_map(recording.touches(0, 1), {.cell_mm = 1.0});
  BoundedOptions options{.lattice = small_options().lattice};
  for (const double gamma : {0.0, 0.1}) {
    options.contact.gamma = gamma;
    bounds.expect_laws(objects, options, recording, 1e-8);
    options.evidence_nats = 0.5;
  }
}

}  // namespace palpate::size_test
