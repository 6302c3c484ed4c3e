#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::dense_belief_test {

/// 1,560 bins in a plane, 7 planes.
HistogramOptions options() {
  HistogramOptions result;
  result.lattice = {
      .x_mm = {-5.0, 5.0, 40}, .y_mm = {-5.0, 5.0, 39}, .theta_rad = {0, 2 * std::numbers::pi, 7}};
  return result;
}

std::vector<Hypothesis> two_objects() {
  return {{random_map(20, 20, 0.5, 4.0, 111), 1.0}, {random_map(18, 21, 0.5, 4.0, 112), 2.0}};
}

/// Everything that a belief tells.
struct Told {
  std::vector<std::vector<double>> log_likelihood;
  std::vector<std::vector<double>> marginal;
  Estimate before;
  Estimate after;
  std::vector<RefinedPose> refined;  ///< about the first bin, one in the middle and the last
};

Told tell(Device& device, const Recording& recording, const HistogramOptions& wanted) {
  const std::vector<Hypothesis> objects = two_objects();
  PoseHistogram histogram(device, objects, wanted);
  Told told;
  told.before = histogram.estimate();
  for (const Touch& touch : all_touches(recording)) {
    histogram.update(touch);
  }
  told.after = histogram.estimate();
  for (const int object : {0, 1}) {
    told.log_likelihood.push_back(histogram.log_likelihood(object));
    Marginals marginals = histogram.marginals(object);
    told.marginal.push_back(std::move(marginals.xy));
    told.marginal.push_back(std::move(marginals.theta));
  }
  for (const std::int64_t bin : {0, 3 * 40 * 39 + 19 * 40 + 20, 7 * 40 * 39 - 1}) {
    told.refined.push_back(histogram.refine({.object = 1, .bin = bin, .T_object_robot = {}}));
  }
  return told;
}

/// A device that is made to look lesser cuts the belief into slabs, which must not show.
class Slabs : public testing::Test {
 protected:
  void expect_unseen(const HistogramOptions& wanted = options()) {
    const Recording recording = random_recording(2, 12, 113);
    const Told whole = tell(device, recording, wanted);
    device.context().lower_limits(limits);
    const Told cut = tell(device, recording, wanted);
    for (std::size_t i = 0; i < whole.log_likelihood.size(); ++i) {
      // Register tiles begin elsewhere in a part of a plane, which rounds a bin's place in its tile
      // differently.
      EXPECT_LT(largest_difference(cut.log_likelihood[i], whole.log_likelihood[i]), 2e-5);
    }
    EXPECT_EQ(cut.before.mode.bin, 0);
    EXPECT_EQ(cut.after.mode.object, whole.after.mode.object);
    EXPECT_EQ(cut.after.mode.bin, whole.after.mode.bin);
    EXPECT_NEAR(cut.after.mode.log_likelihood, whole.after.mode.log_likelihood, 2e-5);
    EXPECT_LT(largest_difference(cut.after.identity, whole.after.identity), 1e-5);
    for (std::size_t i = 0; i < whole.marginal.size(); ++i) {
      EXPECT_LT(largest_difference(cut.marginal[i], whole.marginal[i]), 1e-5);
    }
    for (std::size_t i = 0; i < whole.refined.size(); ++i) {
      const RefinedPose& a = cut.refined[i];
      const RefinedPose& b = whole.refined[i];
      // 2e-5 nats move a mean within 2.5 mm by less than 1e-4 mm.
      EXPECT_NEAR(a.T_object_robot.translation_mm.x, b.T_object_robot.translation_mm.x, 1e-4);
      EXPECT_NEAR(a.T_object_robot.translation_mm.y, b.T_object_robot.translation_mm.y, 1e-4);
      EXPECT_NEAR(a.T_object_robot.theta_rad, b.T_object_robot.theta_rad, 1e-4);
      EXPECT_LT(largest_difference(a.covariance, b.covariance), 2e-4);
    }
  }

  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
};

constexpr std::size_t plane_bytes = std::size_t{40} * 39 * 2 * sizeof(float);

TEST_F(Slabs, OfSeveralPlanesByTheBinding) {
  limits.storage_range = 3 * plane_bytes + 8;
  expect_unseen();
}

TEST_F(Slabs, OfOneObjectOrSeveral) {
  // An odd number of bins: the second object's begin after a gap.
  HistogramOptions wanted = options();
  wanted.lattice.x_mm.count = 41;
  limits.storage_range = std::size_t{41} * 39 * 7 * 2 * sizeof(float) * 3 / 2;
  expect_unseen(wanted);
}

TEST_F(Slabs, OfOnePlane) {
  limits.storage_range = plane_bytes;
  expect_unseen();
}

TEST_F(Slabs, OfPartsOfAPlane) {
  limits.storage_range = plane_bytes / 2 + 8;
  expect_unseen();
}

TEST_F(Slabs, ByTheWorkgroupsAlongX) {
  // 10 workgroups of 64 bins cover less than half a plane.
  limits.group_count[0] = 10;
  expect_unseen();
}

TEST_F(Slabs, ByTheWorkgroupsAlongZ) {
  limits.group_count[2] = 2;
  expect_unseen();
}

TEST_F(Slabs, ByTheWorkgroupsOfAReduction) {
  // 65 workgroups cover each of these planes, but 67 would be needed to reduce all 65 of them.
  HistogramOptions wanted = options();
  wanted.lattice.x_mm.count = 64;
  wanted.lattice.y_mm.count = 65;
  wanted.lattice.theta_rad.count = 65;
  limits.group_count[0] = 65;
  expect_unseen(wanted);
}

TEST(DenseBelief, MoreBinsThanMemoryIsRefusedBeforeAnyIsTaken) {
  Device device = Device::open();
  const std::vector<Hypothesis> objects = two_objects();
  HistogramOptions too_many = options();
  const auto expect_refused = [&] {
    try {
      const PoseHistogram histogram(device, objects, too_many);
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      EXPECT_NE(std::string(error.what()).find("use fewer bins"), std::string::npos)
          << error.what();
    }
  };
  gpu::Limits limits = device.context().limits();
  const std::uint64_t needed = 2 * 7 * plane_bytes;
  limits.memory = needed - 1;
  device.context().lower_limits(limits);
  expect_refused();
  limits.memory = needed + (std::uint64_t{16} << 20);  // also for staging
  device.context().lower_limits(limits);
  EXPECT_NO_THROW(PoseHistogram(device, objects, too_many)) << "the device is still usable";
  // Far beyond 64 bits of bins.
  too_many.lattice.x_mm.count = std::numeric_limits<int>::max();
  too_many.lattice.y_mm.count = std::numeric_limits<int>::max();
  too_many.lattice.theta_rad.count = std::numeric_limits<int>::max();
  expect_refused();
}

}  // namespace palpate::dense_belief_test
