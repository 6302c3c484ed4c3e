// Touches go to the device in batches.

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "estimation/kernel_sizes.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "gpu/context.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::batches_test {

std::vector<Hypothesis> two_objects() {
  return {{random_map(61, 57, 0.5, 12.0, 151), 1.0}, {random_map(33, 29, 1.0, 12.0, 152), 1.0}};
}

HistogramOptions options_of(int x, int y, int theta) {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, x},
                     .y_mm = {-5.0, 5.0, y},
                     .theta_rad = {0.0, 2.0 * std::numbers::pi, theta}};
  return options;
}

TEST(Batches, TakeAsLongAsARunMay) {
  Device device = Device::open();
  const gpu::Context& context = device.context();
  for (const int bins : {10, 40, 120, 200}) {
    const PoseLattice lattice = options_of(bins, bins, bins).lattice;
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

TEST(Histogram, GivesTheSameBitsHoweverTouchesAreGrouped) {
  const Recording recording = random_recording(4, 37, 154);
  const std::vector<Touch> touches = all_touches(recording);
  const std::vector<Hypothesis> objects = two_objects();
  Device device = Device::open();
  for (const int bins : {11, 91}) {  // runs of bins, register tiles
    const HistogramOptions options = options_of(bins, bins, 2);
    PoseHistogram together(device, objects, options);
    together.update(touches);
    PoseHistogram apart(device, objects, options);
    for (const Touch& touch : touches) {
      apart.update(touch);
    }
    for (const int object : {0, 1}) {
      EXPECT_EQ(apart.log_likelihood(object), together.log_likelihood(object));
    }
  }
}

}  // namespace palpate::batches_test
