#include "estimation/kernel_sizes.hpp"

#include <bit>

#include <gtest/gtest.h>

#include "shaders/interface.h"
#include "support/made_up_devices.hpp"

namespace palpate::kernel_sizes_test {

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

}  // namespace palpate::kernel_sizes_test
