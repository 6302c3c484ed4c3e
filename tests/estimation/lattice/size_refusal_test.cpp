// What is more than a device takes is refused in the words of who asked for it, before any memory
// is taken; what is not refused works.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/command_stream.hpp"
#include "gpu/context.hpp"
#include "palpate/error.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::size_refusal_test {

/// A device with less than it has.
struct Less {
  const char* name;
  VkDeviceSize storage_range;
  VkDeviceSize allocation;
  std::uint32_t table_texels;
  VkDeviceSize memory;

  friend std::ostream& operator<<(std::ostream& out, const Less& less) { return out << less.name; }
};

constexpr Less devices[] = {{"little storage", 1 << 13, 1 << 24, 1 << 16, 1 << 28},
                            {"small tables", 1 << 20, 1 << 24, 1 << 9, 1 << 28},
                            {"small allocations", 1 << 27, 1 << 22, 1 << 20, 1 << 28},
                            {"little memory", 1 << 27, 1 << 23, 1 << 20, 12 << 20},
                            {"the least of Vulkan", 1 << 27, 1 << 30, 1 << 16, 1 << 28}};

class Sizes : public testing::TestWithParam<Less> {
 protected:
  Sizes() {
    gpu::Limits limits = device.context().limits();
    limits.storage_range = GetParam().storage_range;
    limits.allocation = GetParam().allocation;
    limits.table_texels = GetParam().table_texels;
    limits.memory = GetParam().memory;
    device.context().lower_limits(limits);
  }

  /// Whether the filter was refused, in words of the user's and before it took memory.
  template <typename Make>
  bool refused(const Make& make, const std::vector<std::string>& words) {
    const VkDeviceSize before = device.context().memory_use().now;
    try {
      make();
      return false;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(error.fault(), Fault::input) << message;
      EXPECT_EQ(device.context().memory_use().now, before) << message;
      EXPECT_TRUE(std::any_of(words.begin(), words.end(), [&](const auto& w) {
        return message.find(w) != std::string::npos;
      })) << message;
      EXPECT_EQ(message.find("binding"), std::string::npos) << message;
      return true;
    }
  }

  Device device = Device::open();
  const Recording recording = random_recording(1, 20, 181);
};

TEST_P(Sizes, OfALatticeWorkOrAreRefused) {
  const std::vector<Hypothesis> objects{{random_map(5, 6, 0.5, 4.0, 182), 1.0},
                                        {random_map(7, 4, 0.5, 4.0, 183), 1.0}};
  int worked = 0;
  int refusals = 0;
  const auto attempt = [&](int x, int y, int theta) {
    SCOPED_TRACE(std::to_string(x) + " x " + std::to_string(y) + " x " + std::to_string(theta));
    HistogramOptions options;
    options.lattice = {.x_mm = {-3, 3, x}, .y_mm = {-3, 3, y}, .theta_rad = {0, 6, theta}};
    const auto run = [&] {
      PoseHistogram histogram(device, objects, options);
      histogram.update(recording.touch(0));
      const Estimate estimate = histogram.estimate();
      EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
      EXPECT_EQ(histogram.marginals(1).theta.size(), static_cast<std::size_t>(theta));
    };
    (refused(run, {"bins " +
                       std::string(x > 1   ? "x"
                                   : y > 1 ? "y"
                                           : "theta") +
                       " = ",
                   "pose bins need", "use fewer bins, objects or cells"})
         ? refusals
         : worked) += 1;
  };
  for (const int many : {100, 1'000, 20'000, 600'000, 2'000'000'000}) {
    attempt(many, 1, 1);
    attempt(1, many, 1);
    attempt(1, 1, many);
  }
  EXPECT_GE(worked, 2);
  EXPECT_GE(refusals, 5);
}

TEST(RefusedSize, SaysWhatIsNeeded) {
  Device device = Device::open();
  gpu::Limits limits = device.context().limits();
  limits.memory = 10 << 20;
  device.context().lower_limits(limits);
  const std::vector<Hypothesis> object{{random_map(5, 6, 0.5, 4.0, 182), 1.0}};
  HistogramOptions options;
  options.lattice = {.x_mm = {-3, 3, 100}, .y_mm = {-3, 3, 100}, .theta_rad = {0, 6, 100}};
  const auto message = [&] {
    try {
      const PoseHistogram histogram(device, object, options);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message(), "device '" + device.name() +
                           "': 4.0 MiB for staging: more than is left of its 10.0 MiB; use fewer "
                           "bins, objects or cells");
  options.none_weight = 1.0;
  EXPECT_EQ(message(), "1 objects x 100 x 100 x 100 pose bins need 16 MiB, device '" +
                           device.name() + "' has 10; use fewer bins or objects")
      << "a touch by itself takes as many bins again";
}

TEST_P(Sizes, OfMapsWorkOrAreRefused) {
  int worked = 0;
  int refusals = 0;
  constexpr int most_cells = 1100;
  for (const int cells : {4, 14, 60, 120, most_cells}) {
    SCOPED_TRACE(cells);
    const std::vector<Hypothesis> objects{{random_map(cells, cells, 0.5, 4.0, 184), 1.0},
                                          {random_map(cells, 3, 0.5, 4.0, 185), 1.0}};
    HistogramOptions options;
    options.lattice = {.x_mm = {-3, 3, 4}, .y_mm = {-3, 3, 3}, .theta_rad = {0, 6, 2}};
    const auto histogram = [&] {
      PoseHistogram built(device, objects, options);
      built.update(recording.touch(0));
      EXPECT_TRUE(std::isfinite(built.estimate().mode.log_likelihood));
    };
    const auto filter = [&] {
      ParticleFilter built(device, objects, {.particles = 50, .region = options.lattice});
      built.update(recording.touch(0));
      EXPECT_GE(built.effective_sample_size(), 1.0);
    };
    (refused(histogram, {"build it with larger cells", "use fewer bins, objects or cells"})
         ? refusals
         : worked) += 1;
    (refused(filter,
             {"build them with larger cells", "particles = 50", "use fewer bins, objects or cells"})
         ? refusals
         : worked) += 1;
  }
  EXPECT_GE(worked, 2);
  // Kernels read a map from storage where no table holds it.
  const bool all_fit = std::min({GetParam().storage_range, GetParam().allocation,
                                 GetParam().memory - gpu::CommandStream::staging_bytes}) >
                       most_cells * most_cells * sizeof(float);
  EXPECT_EQ(refusals == 0, all_fit);
}

TEST_P(Sizes, OfASwarmOfParticlesWorkOrAreRefused) {
  const Hypothesis object{random_map(5, 6, 0.5, 4.0, 186), 1.0};
  for (const int particles : {1, 500, 10'000, 1'000'000}) {
    const auto run = [&] {
      ParticleFilter filter(device, std::span(&object, 1), {.particles = particles});
      filter.update(recording.touch(0));
      EXPECT_GE(filter.effective_sample_size(), 1.0);
    };
    const bool small = particles <= 500;
    EXPECT_TRUE(!refused(run, {"particles = "}) || !small || GetParam().table_texels < 600);
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, Sizes, testing::ValuesIn(devices), [](const auto& test) {
  std::string name = test.param.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

}  // namespace palpate::size_refusal_test
