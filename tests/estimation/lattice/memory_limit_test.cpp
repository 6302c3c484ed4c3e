#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "estimation/kernel_sizes.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "gpu/context.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "synthetic.hpp"

namespace palpate::memory_limit_test {

constexpr std::uint64_t mib = 1 << 20;

std::vector<Hypothesis> two_objects() {
  return {{random_map(61, 57, 0.5, 12.0, 151), 1.0}, {random_map(33, 29, 1.0, 12.0, 152), 1.0}};
}

HistogramOptions options_of(int x, int y, int theta, bool still) {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, x},
                     .y_mm = {-5.0, 5.0, y},
                     .theta_rad = {0.0, 2.0 * std::numbers::pi, theta}};
  options.still_array = still;
  return options;
}

TEST(Batches, TakeAsLongAsARunMay) {
  Device device = Device::open();
  const gpu::Context& context = device.context();
  for (const int bins : {10, 40, 120, 200}) {
    const PoseLattice lattice = options_of(bins, bins, bins, false).lattice;
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

/// All that a histogram tells, and the most memory that it took on the way.
struct Outcome {
  std::vector<std::vector<double>> told;
  std::uint64_t peak_bytes = 0;
  std::uint64_t device_bytes = 0;
};

Outcome run(const HistogramOptions& options, std::span<const Touch> touches) {
  Device device = Device::open();
  const std::vector<Hypothesis> objects = two_objects();
  PoseHistogram histogram(device, objects, options);
  histogram.update(touches);
  Outcome outcome;
  const Estimate estimate = histogram.estimate();
  outcome.told = {estimate.identity, {estimate.none}};
  for (const int object : {0, 1}) {
    const Marginals marginals = histogram.marginals(object);
    outcome.told.insert(outcome.told.end(),
                        {marginals.xy, marginals.theta, histogram.log_likelihood(object)});
  }
  outcome.peak_bytes = device.context().memory_use().peak;
  outcome.device_bytes = histogram.device_bytes();
  return outcome;
}

/// The message of the refusal; none where the histogram is built.
std::optional<std::string> refusal(Device& device, const HistogramOptions& options) {
  const std::uint64_t peak = device.context().memory_use().peak;
  try {
    const PoseHistogram histogram(device, two_objects(), options);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_EQ(device.context().memory_use().peak, peak) << "refused after memory was taken";
    return error.what();
  }
  return {};
}

std::optional<std::string> refusal(const HistogramOptions& options) {
  Device fresh = Device::open();
  return refusal(fresh, options);
}

constexpr std::uint64_t precision = 64 << 10;

/// The smallest limit that is accepted, as precisely.
std::uint64_t least_limit(HistogramOptions options) {
  Device device = Device::open();
  std::uint64_t refused = 0;
  std::uint64_t accepted = 256 * mib;
  while (accepted - refused > precision) {
    const std::uint64_t middle = (refused + accepted) / 2;
    options.memory_limit_bytes = middle;
    (refusal(device, options) ? refused : accepted) = middle;
  }
  return accepted;
}

struct Size {
  int x;
  int y;
  int theta;
  std::size_t elements;
  bool still;
  bool none = false;

  friend std::ostream& operator<<(std::ostream& out, const Size& size) {
    return out << size.x << " x " << size.y << " x " << size.theta << " bins, " << size.elements
               << " elements" << (size.still ? " at rest" : "") << (size.none ? ", or none" : "");
  }
};

class MemoryLimit : public testing::TestWithParam<Size> {};

TEST_P(MemoryLimit, IsKeptAndChangesNoBit) {
  const auto [x, y, theta, elements, still, none] = GetParam();
  Recording recording = random_recording(2, elements, 153);
  if (still) {
    recording.T_robot_sensor.assign(2, {{0.7, -0.4}, 0.3});
    for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
      recording.pressure[i] = i % 4 == 0 ? recording.pressure[i] : 0.0;
    }
  }
  const std::vector<Touch> touches = all_touches(recording);
  HistogramOptions options = options_of(x, y, theta, still);
  if (none) {
    options.none_weight = 1.0;
  }
  const Outcome unlimited = run(options, touches);
  const std::uint64_t least = least_limit(options);
  EXPECT_GE(least, unlimited.told.back().size() * 2 * 8 * (none ? 2 : 1))
      << "two objects' bins, and as many again for one touch by itself";
  options.memory_limit_bytes = least - precision;
  EXPECT_TRUE(refusal(options));
  for (const std::uint64_t limit : {least, least + least / 20, 2 * least}) {
    options.memory_limit_bytes = limit;
    const Outcome limited = run(options, touches);
    EXPECT_LE(limited.peak_bytes, limit);
    EXPECT_LE(limited.device_bytes, limit);
    EXPECT_EQ(limited.told, unlimited.told) << limit << " bytes";
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, MemoryLimit,
                         testing::Values(Size{1, 1, 1, 36, false}, Size{25, 25, 16, 36, false},
                                         Size{9, 7, 1001, 300, false}, Size{60, 50, 20, 36, false},
                                         Size{25, 25, 50, 400, true},
                                         Size{25, 25, 16, 36, false, true}));

TEST(MemoryLimit, ThatIsTooLowIsRefusedWithWhatIsNeeded) {
  HistogramOptions options = options_of(100, 100, 100, false);
  options.memory_limit_bytes = 20 * mib;
  const std::string message = refusal(options).value_or("accepted");
  // Sixteen million bytes of bins, tables and maps, and 8 MiB of staging memory.
  EXPECT_EQ(
      message,
      "memory limit of 20.0 MiB: 2 objects x 100 x 100 x 100 pose bins need 24 MiB; raise it, "
      "or use fewer bins or objects");
  options.memory_limit_bytes = 24 * mib;
  EXPECT_EQ(refusal(options), std::nullopt) << "what the message names is enough";
}

TEST(MemoryLimit, AboveTheDevicesMemoryIsTheDevices) {
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.memory = 10 * mib;
  device.context().lower_limits(limits);
  HistogramOptions options = options_of(100, 100, 100, false);
  options.memory_limit_bytes = 100 * mib;
  try {
    const PoseHistogram histogram(device, two_objects(), options);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_NE(std::string(error.what()).find("has 10;"), std::string::npos) << error.what();
  }
}

TEST(Histogram, GivesTheSameBitsHoweverTouchesAreGrouped) {
  const Recording recording = random_recording(4, 37, 154);
  const std::vector<Touch> touches = all_touches(recording);
  const std::vector<Hypothesis> objects = two_objects();
  Device device = Device::open();
  for (const int bins : {11, 91}) {  // runs of bins, register tiles
    const HistogramOptions options = options_of(bins, bins, 2, false);
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

}  // namespace palpate::memory_limit_test
