// The kernels with the sizes that they take on other devices than the one at hand: large sums and
// maps. Beliefs on these devices are among the cases of filter_laws_test.cpp.

#include <algorithm>
#include <bit>

#include <gtest/gtest.h>

#include "estimation/kernel_sizes.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "palpate/pose_histogram.hpp"
#include "shaders/interface.h"
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

constexpr std::int64_t counts[] = {1,      2,         7,          63,         64,           65,
                                   10'000, 1'000'000, 10'000'000, 50'000'000, 2'000'000'000};

/// A device that allows everything, lowered to one of a kind.
gpu::Limits limits_of(const MadeUpDevice& device) {
  gpu::Limits limits;
  limits.group_invocations = limits.group_size[0] = limits.shared_bytes = ~0U;
  limits.group_size[1] = limits.group_size[2] = ~0U;
  return device.limits(limits);
}

class KernelSizes : public testing::TestWithParam<MadeUpDevice> {
 protected:
  gpu::Limits limits = limits_of(GetParam());

  void expect_workgroup(std::uint32_t lanes) const {
    EXPECT_GE(lanes, 1U);
    EXPECT_LE(lanes, limits.group_invocations);
    EXPECT_LE(lanes, limits.group_size[0]);
    EXPECT_EQ(lanes % std::min(lanes, limits.subgroup), 0U) << "a subgroup is partly idle";
  }
};

TEST_P(KernelSizes, OfAReductionFitTheDeviceAndTheKernel) {
  for (const std::int64_t bins : counts) {
    const ReductionSizes sizes = reduction_sizes(limits, bins);
    expect_workgroup(sizes.lanes);
    EXPECT_TRUE(std::has_single_bit(sizes.lanes)) << "the tree halves them";
    EXPECT_LE(16 * sizes.lanes, limits.shared_bytes);
    EXPECT_EQ(sizes.lanes % sizes.side_by_side, 0U);
    EXPECT_GE(sizes.texels_per_lane, shaders::REDUCE_BATCH);
    EXPECT_EQ(sizes.texels_per_lane % shaders::REDUCE_BATCH, 0U);
    EXPECT_LT(sizes.texels_per_lane, gpu::most_iterations);
    EXPECT_EQ(sizes.side_by_side, std::min(limits.subgroup, sizes.lanes)) << "one stretch each";
  }
}

TEST_P(KernelSizes, OfMapsAndLikelihoodsFitTheDevice) {
  const std::uint32_t block = block_cells(limits);
  EXPECT_EQ(shaders::TILE_CELLS % block, 0U);
  const std::uint32_t edge = shaders::TILE_CELLS / block;
  EXPECT_LE(edge, std::min(limits.group_size[0], limits.group_size[1]));
  expect_workgroup(edge * edge);
  if (block < 4) {
    EXPECT_LT(edge / 2 * (edge / 2), limits.subgroup) << "no larger than the subgroup asks for";
  }
  expect_workgroup(independent_lanes(limits));
}

TEST_P(KernelSizes, FillTheDeviceAsFarAsTheBinsAllow) {
  for (const std::int64_t bins : counts) {
    const std::uint32_t most = most_bins_per_invocation(limits, bins);
    EXPECT_GE(most, 1U);
    EXPECT_LE(most, 25U) << "what an invocation holds in registers";
    const ReductionSizes reduction = reduction_sizes(limits, bins);
    if (limits.cpu) {
      EXPECT_EQ(most, 25U) << "a few invocations fill it";
    } else if (bins >= 10'000'000) {
      EXPECT_GE(bins / most, 1 << 16);
      EXPECT_GE(bins / reduction.bins(), 500);
    } else if (bins <= 1 << 16) {
      EXPECT_EQ(most, 1U);
      EXPECT_EQ(reduction.texels_per_lane, shaders::REDUCE_BATCH);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, KernelSizes, testing::ValuesIn(made_up_devices));

}  // namespace palpate::device_limits_test
