// The kernels with the sizes that they take on other devices than the one at hand.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "shaders/interface.h"
#include "support/made_up_devices.hpp"
#include "support/synthetic.hpp"

namespace palpate::device_limits_test {

std::vector<Hypothesis> two_objects() {
  return {{random_map(31, 27, 0.5, 12.0, 141), 1.0}, {random_map(23, 29, 0.5, 12.0, 142), 2.0}};
}

/// A lattice of nx x 17 x 33 bins: more than one chunk of thetas.
PoseLattice lattice_of(double step_mm, int nx, int thetas = 33) {
  return {.x_mm = {-2.0, -2.0 + step_mm * nx, nx},
          .y_mm = {-3.0, -3.0 + step_mm * 17, 17},
          .theta_rad = {0.0, two_pi, thetas}};
}

class DeviceLimits : public testing::TestWithParam<MadeUpDevice> {
 protected:
  DeviceLimits() { device.context().lower_limits(GetParam().limits(device.context().limits())); }

  Device device = Device::open();
};

TEST_P(DeviceLimits, LeaveBeliefsAsTheReferenceHasThem) {
  const Recording recording = random_recording(2, 36, 143);
  const std::vector<Touch> touches = all_touches(recording);
  const std::vector<Hypothesis> objects = two_objects();
  // Register tiles and runs of bins, pairs of bins within a row and across rows.
  for (const auto& [step_mm, nx] : {std::pair(0.1, 19), std::pair(0.8, 20)}) {
    HistogramOptions options;
    options.lattice = lattice_of(step_mm, nx);
    PoseHistogram histogram(device, objects, options);
    EXPECT_EQ(histogram.estimate().mode.bin, 0) << "the first of equals";
    histogram.update(touches);
    const reference::Posterior expected = reference_posterior(objects, options, touches);
    EXPECT_LT(likelihood_error(histogram, expected), 2 * per_touch);
    // Two touches of that error change a probability by as much.
    constexpr double probability = 4 * per_touch;
    const Estimate estimate = histogram.estimate();
    EXPECT_LT(largest_difference(estimate.identity, reference::identity(expected)), probability);
    EXPECT_EQ(estimate.mode.object, reference::mode(expected).object);
    EXPECT_EQ(estimate.mode.bin, reference::mode(expected).bin);
    for (const int object : {0, 1}) {
      const Marginals marginals = histogram.marginals(object);
      EXPECT_LT(largest_difference(marginals.xy, reference::marginal_xy(expected, object)),
                probability);
      EXPECT_LT(largest_difference(marginals.theta, reference::marginal_theta(expected, object)),
                probability);
    }
  }
}

TEST_P(DeviceLimits, LeaveSumsOverMillionsOfBinsAsFloat64HasThem) {
  const Hypothesis object{random_map(31, 27, 0.5, 2.0, 145), 1.0};
  HistogramOptions options;
  // So many that a GPU's lanes take more than one batch.
  options.lattice = {.x_mm = {-5.0, 5.0, 203}, .y_mm = {-5.0, 5.0, 199}, .theta_rad = {0, 1, 107}};
  const Recording recording = random_recording(1, 3, 146);
  PoseHistogram histogram(device, std::span(&object, 1), options);
  histogram.update(all_touches(recording));
  const std::vector<double> logs = histogram.log_likelihood(0);
  const auto most = std::max_element(logs.begin(), logs.end());
  const Estimate estimate = histogram.estimate();
  EXPECT_EQ(estimate.mode.bin, most - logs.begin());
  EXPECT_EQ(estimate.mode.log_likelihood, *most);
  std::vector<double> xy(static_cast<std::size_t>(options.lattice.plane()), 0.0);
  std::vector<double> theta(107, 0.0);
  double total = 0.0;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const double p = std::exp(logs[i] - *most);
    xy[i % xy.size()] += p;
    theta[i / xy.size()] += p;
    total += p;
  }
  for (double& p : xy) {
    p /= total;
  }
  for (double& p : theta) {
    p /= total;
  }
  // Sums of float32 parts, each of at most 512 terms: a relative 512 * 6e-8.
  const Marginals marginals = histogram.marginals(0);
  EXPECT_LT(largest_difference(marginals.xy, xy), 3e-5 * *std::max_element(xy.begin(), xy.end()));
  EXPECT_LT(largest_difference(marginals.theta, theta),
            3e-5 * *std::max_element(theta.begin(), theta.end()));
}

TEST_P(DeviceLimits, LeaveMapsAsTheReferenceHasThem) {
  const Recording recording = random_recording(2, 36, 147);
  const std::vector<Touch> touches = all_touches(recording);
  for (const double cell_mm : {0.2, 1.0}) {
    const MapOptions options{.cell_mm = cell_mm};
    MapBuilder builder(device, options);
    builder.add(touches);
    EXPECT_LT(map_error(builder.build("made up"), touches, options), 1e-3)
        << "what the method allows";
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, DeviceLimits, testing::ValuesIn(made_up_devices));

constexpr int large_map_cells = 40;

/// Cells of a map as kernels read it.
constexpr std::uint32_t bordered(int nx, int ny) {
  return static_cast<std::uint32_t>((nx + 2 * shaders::MAP_BORDER) *
                                    (ny + 2 * shaders::MAP_BORDER));
}

TEST(LargeMap, IsReadFromStorageWhereNoTableHoldsIt) {
  const Recording recording = random_recording(2, 36, 148);
  const std::vector<Touch> touches = all_touches(recording);
  // Beside one that a table holds, of the same cells.
  const std::vector<Hypothesis> objects{
      {random_map(large_map_cells, large_map_cells, 0.5, 12.0, 149), 1.0},
      {random_map(9, 11, 0.5, 12.0, 150), 1.0}};
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.table_texels = bordered(large_map_cells, large_map_cells) - 1;
  device.context().lower_limits(limits);
  for (const double step_mm : {0.1, 0.25, 0.8}) {
    HistogramOptions options;
    options.lattice = lattice_of(step_mm, 19, 3);
    PoseHistogram histogram(device, objects, options);
    EXPECT_EQ(histogram.paths().size(), 2U);
    histogram.update(touches);
    EXPECT_LT(likelihood_error(histogram, reference_posterior(objects, options, touches)),
              2 * per_touch);
  }
}

TEST(LargeMap, ManyMapsGoIntoSeveralTables) {
  const Recording recording = random_recording(2, 36, 151);
  const std::vector<Touch> touches = all_touches(recording);
  std::vector<Hypothesis> objects;
  for (std::uint64_t i = 0; i < 5; ++i) {
    objects.push_back({random_map(11, 12, i == 2 ? 0.3 : 0.5, 12.0, 152 + i), 1.0});
  }
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.table_texels = 2 * bordered(11, 12);
  device.context().lower_limits(limits);
  for (const double step_mm : {0.1, 0.25, 0.8}) {
    HistogramOptions options;
    options.lattice = lattice_of(step_mm, 19, 3);
    PoseHistogram histogram(device, objects, options);
    EXPECT_EQ(histogram.paths().size(), 2U) << "two sizes of cells";
    histogram.update(touches);
    EXPECT_LT(likelihood_error(histogram, reference_posterior(objects, options, touches)),
              2 * per_touch);
  }
}

TEST(LargeMap, ThatNoBufferHoldsIsRefusedByItsLabel) {
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.table_texels = 1000;
  limits.storage_range = (bordered(large_map_cells, large_map_cells) - 1) * sizeof(float);
  device.context().lower_limits(limits);
  const Hypothesis object{random_map(large_map_cells, large_map_cells, 0.5, 1.0, 114), 1.0};
  HistogramOptions small;
  small.lattice = {.x_mm = {-1, 1, 2}, .y_mm = {-1, 1, 2}, .theta_rad = {0, 1, 2}};
  try {
    const PoseHistogram histogram(device, std::span(&object, 1), small);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_NE(std::string(error.what()).find("'made up'"), std::string::npos) << error.what();
  }
}

}  // namespace palpate::device_limits_test
