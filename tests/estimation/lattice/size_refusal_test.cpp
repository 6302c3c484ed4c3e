// What is more than a device takes is refused in the words of who asked for it, before any memory
// is taken; what is not refused works.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "gpu/command_stream.hpp"
#include "made_up_sensors.hpp"
#include "palpate/error.hpp"
#include "shaders/interface.h"
#include "support/errors.hpp"

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
  /// Whether the filter was refused, in words of the user's and before it took memory.
  bool refused(const std::function<void()>& make, const std::vector<std::string>& words) {
    const VkDeviceSize before = device.context().memory_use().now;
    try {
      make();
      return false;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(error.fault(), Fault::input) << message;
      EXPECT_EQ(device.context().memory_use().now, before) << message;
      EXPECT_TRUE(std::ranges::any_of(words, [&](const std::string& word) {
        return message.find(word) != std::string::npos;
      })) << message;
      EXPECT_EQ(message.find("binding"), std::string::npos) << message;
      return true;
    }
  }

  Device device = lowered_device([](gpu::Limits& limits) {
    limits.storage_range = GetParam().storage_range;
    limits.allocation = GetParam().allocation;
    limits.table_texels = GetParam().table_texels;
    limits.memory = GetParam().memory;
  });
  const Recording recording = random_recording(1, 20, 181);
};

TEST_P(Sizes, OfALatticeWorkOrAreRefused) {
  const std::vector<Hypothesis> objects{{random_map(5, 6, 0.5, 4.0, 182), 1.0},
                                        {random_map(7, 4, 0.5, 4.0, 183), 1.0}};
  int worked = 0;
  constexpr std::pair<const char*, Axis PoseLattice::*> axes[] = {
      {"x", &PoseLattice::x_mm}, {"y", &PoseLattice::y_mm}, {"theta", &PoseLattice::theta_rad}};
  for (const int many : {100, 1'000, 20'000, 600'000, 2'000'000'000}) {
    for (const auto& [name, axis] : axes) {
      SCOPED_TRACE(std::to_string(many) + " along " + name);
      HistogramOptions options;
      options.lattice = {.x_mm = {-3, 3, 1}, .y_mm = {-3, 3, 1}, .theta_rad = {0, 6, 1}};
      (options.lattice.*axis).count = many;
      const auto run = [&] {
        PoseHistogram histogram(device, objects, options);
        histogram.update(recording.touch(0));
        EXPECT_TRUE(std::isfinite(histogram.estimate().mode.log_likelihood));
        EXPECT_EQ(histogram.marginals(1).theta.size(), options.lattice.theta_rad.count);
      };
      worked += refused(run, {"bins " + std::string(name) + " = ", "pose bins need",
                              "use fewer bins, objects or cells"})
                    ? 0
                    : 1;
    }
  }
  EXPECT_GE(worked, 2);
  EXPECT_LE(worked, 10);
}

TEST_P(Sizes, OfMapsWorkOrAreRefused) {
  int worked = 0;
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
    constexpr const char* fewer = "use fewer bins, objects or cells";
    worked += refused(histogram, {"build it with larger cells", fewer}) ? 0 : 1;
    worked += refused(filter, {"build them with larger cells", "particles = 50", fewer}) ? 0 : 1;
  }
  EXPECT_GE(worked, 2);
  // Kernels read a map from storage where no table holds it.
  const bool all_fit = std::min({GetParam().storage_range, GetParam().allocation,
                                 GetParam().memory - gpu::CommandStream::staging_bytes}) >
                       most_cells * most_cells * sizeof(float);
  EXPECT_EQ(worked == 10, all_fit);
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
  std::ranges::replace(name, ' ', '_');
  return name;
});

/// Why a histogram of one object is refused where a device has less of something.
std::string refusal(const std::function<void(gpu::Limits&)>& lower, const HistogramOptions& options,
                    const OccupancyGrid& map = random_map(5, 6, 0.5, 4.0, 182)) {
  Device device = lowered_device(lower);
  const Hypothesis object{map, 1.0};
  return input_error([&] { const PoseHistogram made(device, std::span(&object, 1), options); });
}

TEST(RefusedSize, SaysWhatIsNeeded) {
  const std::string name = Device::open().name();
  const auto little = [](gpu::Limits& limits) { limits.memory = 10 << 20; };
  HistogramOptions options;
  options.lattice = {.x_mm = {-3, 3, 100}, .y_mm = {-3, 3, 100}, .theta_rad = {0, 6, 100}};
  EXPECT_EQ(refusal(little, options),
            "device '" + name +
                "': 4.0 MiB for staging: more than is left of its 10.0 MiB; use fewer bins, "
                "objects or cells");
  options.none_weight = 1.0;
  EXPECT_EQ(refusal(little, options),
            "1 objects x 100 x 100 x 100 pose bins need 16 MiB, device '" + name +
                "' has 10; use fewer bins or objects")
      << "a touch by itself takes as many bins again";
  constexpr int most = std::numeric_limits<int>::max();
  options.lattice = {.x_mm = {-3, 3, most}, .y_mm = {-3, 3, most}, .theta_rad = {0, 6, most}};
  expect_named(refusal(little, options), {"use fewer bins"});
}

TEST(RefusedSize, IsOfTheLastByte) {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5, 5, 40}, .y_mm = {-5, 5, 39}, .theta_rad = {0, two_pi, 7}};
  const auto needed = static_cast<std::uint64_t>(options.lattice.bins()) * 8;
  expect_named(refusal([&](gpu::Limits& limits) { limits.memory = needed - 1; }, options),
               {"use fewer bins"});
  // Also for staging.
  Device device = lowered_device([&](gpu::Limits& limits) { limits.memory = needed + (16 << 20); });
  const Hypothesis object{random_map(5, 6, 0.5, 4.0, 182), 1.0};
  EXPECT_NO_THROW(PoseHistogram(device, std::span(&object, 1), options));
}

TEST(RefusedSize, NamesWhatToMakeSmaller) {
  const HistogramOptions small{
      .lattice = {.x_mm = {-1, 1, 2}, .y_mm = {-1, 1, 2}, .theta_rad = {0, 1, 2}}};
  const auto large_map = [](gpu::Limits& limits) {
    constexpr int edge = 40 + 2 * shaders::MAP_BORDER;
    limits.table_texels = 1000;
    limits.storage_range = (edge * edge - 1) * sizeof(float);
  };
  expect_named(refusal(large_map, small, random_map(40, 40, 0.5, 1.0, 114)), {"'made up'"});

  // One texel fewer than the table's rows of 521 nodes.
  const ContactModel learned = random_table(1);
  const auto large_table = [](gpu::Limits& limits) { limits.table_texels = 5 * 521 - 1; };
  expect_named(refusal(large_table, {.lattice = {}, .contact = learned}), {"use fewer nodes"});

  // Slabs of 11, 11 and 2 thetas: a Gaussian of 0.2 rad reaches 4.
  const HistogramOptions blurred{
      .lattice = {.x_mm = {-5.0, 6.0, 17}, .y_mm = {-3.0, 3.0, 9}, .theta_rad = {0.0, two_pi, 24}},
      .touch_sd = {.mm = 1.0, .rad = 0.2}};
  const auto planes = [](double count) {
    return [bytes = static_cast<VkDeviceSize>(count * 17 * 9) * 8](gpu::Limits& limits) {
      limits.storage_range = bytes;
    };
  };
  expect_named(refusal(planes(11.2), blurred), {"use fewer bins"});
  expect_named(refusal(planes(0.7), blurred), {"bins x times y = 153"});
}

}  // namespace palpate::size_refusal_test
