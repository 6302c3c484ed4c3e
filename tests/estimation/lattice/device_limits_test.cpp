// The kernels with the sizes that they take on other devices than the one at hand: large sums and
// maps. Beliefs on these devices are among the cases of filter_laws_test.cpp.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "estimation/kernel_sizes.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/made_up_devices.hpp"
#include "support/synthetic.hpp"

namespace palpate::device_limits_test {

class DeviceLimits : public testing::TestWithParam<MadeUpDevice> {
 protected:
  DeviceLimits() { device.context().lower_limits(GetParam().limits(device.context().limits())); }

  Device device = Device::open();
};

TEST_P(DeviceLimits, LeaveSumsOverMillionsOfBinsAsFloat64HasThem) {
  const Hypothesis object{random_map(31, 27, 0.5, 2.0, 145), 1.0};
  HistogramOptions options;
  // So many that a GPU's lanes take more than one batch.
  options.lattice = {.x_mm = {-5.0, 5.0, 203}, .y_mm = {-5.0, 5.0, 199}, .theta_rad = {0, 1, 107}};
  const Recording recording = random_recording(1, 3, 146);
  PoseHistogram histogram(device, std::span(&object, 1), options);
  histogram.update(all_touches(recording));
  const reference::Posterior own{options.lattice, {histogram.log_likelihood(0)}, {1.0}};
  const Mode mode = histogram.estimate().mode;
  EXPECT_EQ(mode.bin, reference::mode(own).bin);
  EXPECT_EQ(mode.log_likelihood, std::ranges::max(own.log_likelihood[0]));
  // Sums of float32 parts, each of at most 512 terms: a relative 512 * 6e-8.
  const auto expect_near = [](const std::vector<double>& sums, const std::vector<double>& of) {
    EXPECT_LT(largest_difference(sums, of), 3e-5 * std::ranges::max(of));
  };
  const Marginals marginals = histogram.marginals(0);
  expect_near(marginals.xy, reference::marginal_xy(own, 0));
  expect_near(marginals.theta, reference::marginal_theta(own, 0));
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

TEST(Batches, TakeAsLongAsARunMay) {
  Device device = Device::open();
  const gpu::Context& context = device.context();
  for (const int bins : {10, 40, 120, 200}) {
    const PoseLattice lattice{
        .x_mm = {-5, 5, bins}, .y_mm = {-5, 5, bins}, .theta_rad = {0, two_pi, bins}};
    std::int64_t largest = 0;
    for (const SlabExtent& slab : DenseBelief::cut(context, lattice, 5)) {
      largest = std::max(largest, slab.object_count * slab.bins());
    }
    const auto elements = static_cast<double>(DenseLikelihood::batch_for(context, lattice, 5));
    EXPECT_GE(elements, 8.0);
    EXPECT_LE(elements * static_cast<double>(largest),
              std::max(16.0 * static_cast<double>(largest), work_per_run(context.limits())))
        << bins << " bins along each axis";
  }
}

}  // namespace palpate::device_limits_test
