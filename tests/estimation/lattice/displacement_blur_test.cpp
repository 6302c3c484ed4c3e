// The blur over displacements where an object's bins lie in several parts of the device's memory,
// and where a Gaussian reaches far.

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::displacement_blur_test {

constexpr int nx = 17;
constexpr int ny = 9;
constexpr int thetas = 24;

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 81), 2.0},
                                           {random_map(23, 29, 0.5, 12.0, 82), 1.0}};
  return two;
}

/// A device whose buffers hold so many planes of a theta.
Device small_device(double planes) {
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.storage_range = static_cast<VkDeviceSize>(planes * nx * ny) * 8;
  device.context().lower_limits(limits);
  return device;
}

HistogramOptions options_of(double upper_rad) {
  return {.lattice = {.x_mm = {-5.0, 6.0, nx},
                      .y_mm = {-3.0, 3.0, ny},
                      .theta_rad = {0.0, upper_rad, thetas}},
          .none_weight = 3.0,
          .touch_sd = {.mm = 1.0, .rad = 0.2},
          .slip_sd = {.mm = 0.5, .rad = 0.2}};
}

TEST(DisplacementBlur, OfSeveralSlabsIsTheSame) {
  const Recording recording = random_recording(2, 40, 83);
  const std::vector<Touch> touches = all_touches(recording);
  // The circle, whose last theta neighbours its first, and a part of it, which ends.
  for (const double upper_rad : {two_pi, 4.0}) {
    const HistogramOptions options = options_of(upper_rad);
    Device device = Device::open();
    PoseHistogram whole(device, objects(), options);
    whole.update(touches);
    // Slabs of 13 and 11 thetas, and of 9, 9 and 6; a Gaussian reaches 4 or 5.
    for (const double planes : {13.2, 9.2}) {
      SCOPED_TRACE(planes);
      Device small = small_device(planes);
      PoseHistogram parts(small, objects(), options);
      parts.update(touches);
      for (const int object : {0, 1}) {
        // Sums of a reduction differ by rounding, and with them the mass that a slip restores.
        EXPECT_LT(largest_difference(parts.log_likelihood(object), whole.log_likelihood(object)),
                  1e-5);
      }
      EXPECT_NEAR(parts.estimate().none, whole.estimate().none, 1e-6);
    }
  }
}

std::string refusal(double planes) {
  Device small = small_device(planes);
  try {
    const PoseHistogram histogram(small, objects(), options_of(two_pi));
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    return error.what();
  }
  return {};
}

TEST(DisplacementBlur, OfSlabsWithTooFewThetasIsRefused) {
  // Slabs of 11, 11 and 2 thetas: a Gaussian of 0.2 rad reaches 4.
  EXPECT_NE(refusal(11.2).find("use fewer bins"), std::string::npos) << refusal(11.2);
}

TEST(DisplacementBlur, OfPlanesInPartsIsRefused) {
  EXPECT_NE(refusal(0.7).find("bins x times y = 153"), std::string::npos) << refusal(0.7);
}

TEST(DisplacementBlur, ReachesFarAlongFineBins) {
  // Weights beyond 32 bins stand in a table, not in the kernel. Even and odd numbers of bins.
  const Recording recording = random_recording(1, 40, 84);
  const Touch touch = recording.touch(0);
  for (const int count : {100, 101}) {
    for (const bool along_x : {true, false}) {
      PoseLattice lattice{
          .x_mm = {-5.0, 5.0, 5}, .y_mm = {-5.0, 5.0, 5}, .theta_rad = {0.0, two_pi, 3}};
      (along_x ? lattice.x_mm : lattice.y_mm).count = count;
      HistogramOptions options{.lattice = lattice, .touch_sd = {.mm = 1.0}};
      options.contact.prior = 0.2;
      Device device = Device::open();
      PoseHistogram histogram(device, objects(), options);
      histogram.update(touch);
      for (const std::size_t object : {0U, 1U}) {
        const std::vector<double> expected = reference::displaced_touch(
            reference::log_likelihoods(std::span(&touch, 1), lattice, objects()[object].map,
                                       options.contact, object),
            lattice, options.touch_sd, touch.T_robot_sensor);
        EXPECT_LT(largest_difference(histogram.log_likelihood(static_cast<int>(object)), expected),
                  1e-3);  // what the method allows
      }
    }
  }
}

TEST(DisplacementBlur, OfGaussiansNarrowerThanABinIsThatOfTheReference) {
  // A neighbour's weight is down to exp(-800). Without a floor, its likelihood is up to exp(1e4)
  // times a bin's, and float32 keeps 6 digits of such logs.
  const Recording recording = random_recording(1, 900, 85);
  const Touch touch = recording.touch(0);
  const PoseLattice lattice{
      .x_mm = {-5.0, 6.0, 15}, .y_mm = {-3.0, 3.0, 9}, .theta_rad = {0.0, two_pi, 20}};
  Device device = Device::open();
  for (const double steps_of_sd : {4.0, 9.0, 12.5, 13.3, 14.5, 20.0, 37.0, 40.0}) {
    for (const auto& [mm, rad] : {std::pair(1.0, 0.0), std::pair(0.0, 1.0), std::pair(1.0, 1.0)}) {
      SCOPED_TRACE(fmt::format("step / {}, {} {}", steps_of_sd, mm, rad));
      HistogramOptions options{.lattice = lattice,
                               .touch_sd = {.mm = mm * lattice.x_mm.step() / steps_of_sd,
                                            .rad = rad * lattice.theta_rad.step() / steps_of_sd}};
      options.contact.prior = 0.2;
      options.contact.gamma = 0.0;
      PoseHistogram histogram(device, objects(), options);
      histogram.update(touch);
      const std::vector<double> exact = reference::log_likelihoods(
          std::span(&touch, 1), lattice, objects()[0].map, options.contact, 0);
      const std::vector<double> expected =
          reference::displaced_touch(exact, lattice, options.touch_sd, touch.T_robot_sensor);
      EXPECT_LT(largest_difference(histogram.log_likelihood(0), expected), 1e-2);
    }
  }
}

}  // namespace palpate::displacement_blur_test
