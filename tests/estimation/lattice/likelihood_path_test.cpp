#include <cmath>
#include <numbers>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::likelihood_path_test {

constexpr double cell_mm = 0.5;

/// A lattice of this step in map cells whose first bin lies at no special place.
PoseLattice lattice_of(double step_x, double step_y, int nx, int ny) {
  const double x = -2.13;
  const double y = 1.37;
  return {.x_mm = {x, x + step_x * cell_mm * nx, nx},
          .y_mm = {y, y + step_y * cell_mm * ny, ny},
          .theta_rad = {0.1, 0.1 + 2.0 * std::numbers::pi, 2}};
}

struct Result {
  std::string path;
  double error_per_touch = 0.0;
};

Result run(Device& device, const PoseLattice& lattice, double steepness, std::size_t elements,
           double gamma = 0.1) {
  const std::vector<Hypothesis> hypotheses{{random_map(31, 27, cell_mm, steepness, 48), 1.0}};
  const Recording recording = random_recording(2, elements, 7 + elements);
  HistogramOptions options;
  options.lattice = lattice;
  options.contact.gamma = gamma;
  PoseHistogram histogram(device, hypotheses, options);
  const std::vector<Touch> touches = all_touches(recording);
  histogram.update(touches);
  return {histogram.paths().front(),
          likelihood_error(histogram, reference_posterior(hypotheses, options, touches)) / 2.0};
}

struct Case {
  double step_x;
  double step_y;
  const char* path;  ///< what must be chosen, so that the cases reach every kernel and tile

  friend std::ostream& operator<<(std::ostream& out, const Case& c) {
    return out << c.step_x << " x " << c.step_y << " cells, " << c.path;
  }
};

class Steps : public testing::TestWithParam<Case> {};

TEST_P(Steps, TakeTheRightPathAndAgree) {
  const auto& [step_x, step_y, path] = GetParam();
  // The path of a CPU device: a GPU takes few bins of small lattices together.
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.cpu = true;
  device.context().lower_limits(limits);
  for (const int count : {7, 23}) {
    const Result result = run(device, lattice_of(step_x, step_y, count, count), 12.0, 36);
    EXPECT_NE(result.path.find(path), std::string::npos) << result.path;
    EXPECT_LT(result.error_per_touch, per_touch) << result.path;
  }
}

INSTANTIATE_TEST_SUITE_P(Cells, Steps,
                         testing::Values(Case{0.2, 0.2, "5 x 5 bins over one cell"},
                                         Case{0.25, 0.25, "5 x 5 bins over one cell"},
                                         Case{0.01, 0.07, "5 x 5 bins over one cell"},
                                         Case{1.0 / 3.0, 0.3, "4 x 4 bins over one cell"},
                                         Case{0.2, 1.0, "5 x 2 bins over one cell"},
                                         Case{0.4, 0.4, "5 x 5 bins over two cells"},
                                         Case{0.5, 0.5, "5 x 5 bins over two cells"},
                                         Case{0.6, 2.0 / 3.0, "4 x 4 bins over two cells"},
                                         Case{0.51, 0.99, "4 x 3 bins over two cells"},
                                         Case{2.0, 0.25, "2 x 5 bins over two cells"},
                                         Case{1.0, 1.0, "runs of"}, Case{0.2, 3.0, "runs of"},
                                         Case{1.0, 1.3, "runs of"}, Case{1.6, 1.6, "runs of"},
                                         Case{9.7, 0.9, "runs of"}));

class FineBins : public testing::TestWithParam<int> {};

TEST_P(FineBins, AgreeAlongEitherAxis) {
  // Down to one bin per axis, and with counts that no tile divides.
  Device device = Device::open();
  for (const double step : {0.2, 0.3, 0.6, 1.6}) {
    for (const auto& [nx, ny] : {std::pair(GetParam(), 3), std::pair(3, GetParam())}) {
      EXPECT_LT(run(device, lattice_of(step, step, nx, ny), 12.0, 36).error_per_touch, per_touch);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Bins, FineBins, testing::Values(1, 7, 63, 65, 1000));

class ElementCounts : public testing::TestWithParam<std::size_t> {};

TEST_P(ElementCounts, AgreeOnEveryPath) {
  // The tolerance is for arrays of 36; the errors of more elements add up.
  const double arrays = std::max(1.0, static_cast<double>(GetParam()) / 36.0);
  Device device = Device::open();
  for (const double step : {0.2, 0.3, 0.6, 1.6}) {
    EXPECT_LT(run(device, lattice_of(step, step, 11, 9), 12.0, GetParam()).error_per_touch,
              per_touch * arrays);
  }
}

INSTANTIATE_TEST_SUITE_P(Elements, ElementCounts, testing::Values(0, 1, 36, 37, 256, 1400));

TEST(LikelihoodPaths, AgreeOnSteepAndFlatMaps) {
  Device device = Device::open();
  for (const double step : {0.2, 0.3, 0.6, 1.6}) {
    const PoseLattice lattice = lattice_of(step, step, 21, 19);
    EXPECT_LT(run(device, lattice, 130.0, 36).error_per_touch, per_touch) << step;
    EXPECT_LT(run(device, lattice, 0.0, 36).error_per_touch, per_touch) << step;
  }
}

TEST(LikelihoodPaths, AgreeWithoutAFloorUnderTheLikelihood) {
  Device device = Device::open();
  // Tiles over one cell and over two, and runs.
  for (const double step : {0.2, 0.6, 1.6}) {
    const PoseLattice lattice = lattice_of(step, step, 11, 9);
    // No floor, one too small for products, and the least that products take.
    for (const double gamma : {0.0, 1e-6, 5e-3}) {
      EXPECT_LT(run(device, lattice, 12.0, 36, gamma).error_per_touch, per_touch) << gamma;
    }
  }
}

TEST(LikelihoodPaths, AgreeAtTheMapsEdgeAndBeyond) {
  // The map spans 15.5 x 13.5 mm about the origin; elements reach 14 mm from it.
  Device device = Device::open();
  for (const double step : {0.2, 1.6}) {
    for (const double offset : {6.0, 18.0, 400.0}) {
      PoseLattice lattice = lattice_of(step, step, 31, 29);
      for (Axis* axis : {&lattice.x_mm, &lattice.y_mm}) {
        axis->lower += offset;
        axis->upper += offset;
      }
      EXPECT_LT(run(device, lattice, 12.0, 36).error_per_touch, per_touch) << offset;
    }
  }
}

}  // namespace palpate::likelihood_path_test
