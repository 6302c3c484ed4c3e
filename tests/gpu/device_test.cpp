// Which device is taken, what it can do, and what is said where there is none.

#include "palpate/device.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <link.h>

#include "gpu/context.hpp"
#include "gpu/owned.hpp"
#include "gpu/selection.hpp"
#include "support/errors.hpp"
#include "support/variable.hpp"

namespace palpate::gpu::device_test {

TEST(Device, ListTellsWhichOneOpensAndHowEachDoes) {
  const std::vector<DeviceInfo> infos = Device::list();
  ASSERT_FALSE(infos.empty()) << "no Vulkan device: install mesa-vulkan-drivers";
  const auto chosen = [](const DeviceInfo& info) { return info.chosen; };
  ASSERT_EQ(std::count_if(infos.begin(), infos.end(), chosen), 1);
  EXPECT_EQ(std::find_if(infos.begin(), infos.end(), chosen)->name, Device::open().name());
  for (std::size_t i = 0; i < infos.size(); ++i) {
    EXPECT_EQ(infos[i].index, static_cast<int>(i));
    EXPECT_FALSE(infos[i].reason.empty());
    EXPECT_EQ(infos[i].api.substr(0, 2), "1.");
    EXPECT_GT(infos[i].memory_gib, 0.0);
    EXPECT_TRUE(infos[i].usable || !infos[i].chosen);
    if (infos[i].usable) {
      EXPECT_EQ(Device::open(std::to_string(i)).name(), infos[i].name);
      std::string name = infos[i].name;
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::toupper(c); });
      EXPECT_EQ(Device::open(name).name(), infos[i].name);
    }
  }
}

TEST(Device, OneThatDoesNotExistIsRefusedNamingThoseThatDo) {
  for (const char* wish : {"no such device", "99"}) {
    const std::vector<DeviceInfo> infos = Device::list(wish);
    const std::string message = input_error([&] { Device::open(wish); });
    expect_named(message, {wish});
    for (const DeviceInfo& info : infos) {
      EXPECT_FALSE(info.chosen);
      expect_named(message, {info.name.c_str()});
    }
  }
}

TEST(Device, LeavesItsDriverLoaded) {
  // A driver that is loaded again for every device fails after some: NVIDIA's after 25.
  const auto libraries = [] {
    int count = 0;
    const auto one_more = [](dl_phdr_info* /*info*/, std::size_t /*size*/, void* counted) {
      ++*static_cast<int*>(counted);
      return 0;
    };
    dl_iterate_phdr(one_more, &count);
    return count;
  };
  std::optional<Device> device = Device::open();
  const int while_open = libraries();
  device.reset();
  EXPECT_EQ(libraries(), while_open);
}

TEST(Device, AMachineWithoutADriverSaysSo) {
  const Variable files("VK_DRIVER_FILES", "/nonexistent.json");
  const Variable older("VK_ICD_FILENAMES", "/nonexistent.json");  // its name in older loaders
  expect_named(error_of(Fault::system, [] { Device::open(); }), {"mesa-vulkan-drivers"});
}

TEST(Device, MovesAndSaysSoWhereItWasMovedFrom) {
  Device first = Device::open();
  const std::string name = first.name();
  Context* const context = &first.context();
  Device second(std::move(first));
  EXPECT_EQ(second.name(), name);
  EXPECT_EQ(&second.context(), context);
  // The test uses a moved-from device on purpose.
  for (const std::function<void()>& call : std::initializer_list<std::function<void()>>{
           [&] { first.name(); },          // NOLINT(bugprone-use-after-move)
           [&] { first.memory_bytes(); },  // NOLINT(bugprone-use-after-move)
           [&] { first.context(); }}) {    // NOLINT(bugprone-use-after-move)
    expect_named(input_error(call), {"device: was moved from"});
  }
}

TEST(Context, AMemoryTypeThatDoesNotExistIsAnError) {
  Device device = Device::open();
  EXPECT_THROW(device.context().memory_type(0, 0, 0), Error);
}

/// Opens devices in a process that has not loaded Vulkan, at first by this library; ends it with 3
/// where each of those attempts fails as the machine's fault, and says why, and a later one works.
[[noreturn]] void open_with(const char* library) {
  {
    const Variable loader("PALPATE_VULKAN_LIBRARY", library);
    std::fprintf(stderr, "%s\n", error_of(Fault::system, [] { Device::list(); }).c_str());
    std::fprintf(stderr, "%s\n", error_of(Fault::system, [] { Device::open(); }).c_str());
  }
  std::exit(Device::open().name().empty() || testing::Test::HasFailure() ? 4 : 3);
}

TEST(VulkanDeathTest, NamesALoaderThatIsMissingOrNoneAndTriesAgainLater) {
  // Each child starts anew: this process may have Vulkan.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(open_with("/nonexistent/libvulkan.so.1"), testing::ExitedWithCode(3),
              "^Vulkan cannot be loaded: /nonexistent/libvulkan.so.1: [^\n]*; on Debian, install "
              "libvulkan1 and mesa-vulkan-drivers\n");
  EXPECT_EXIT(open_with("libm.so.6"), testing::ExitedWithCode(3),
              "^Vulkan cannot be loaded: libm.so.6 is no loader of Vulkan 1.1; ");
}

TEST(Result, OfAnErrorIsOneLineThatSaysWhatWasDoneAndWhatMendsIt) {
  EXPECT_NO_THROW(check(VK_SUCCESS, "doing this"));
  const std::pair<VkResult, const char*> errors[] = {
      {VK_ERROR_DEVICE_LOST, "doing this: the device was lost"},
      {VK_ERROR_DEVICE_LOST, "fewer bins"},
      {VK_ERROR_OUT_OF_DEVICE_MEMORY, "doing this: out of device memory"},
      {VK_ERROR_OUT_OF_DEVICE_MEMORY, "fewer bins"},
      {VK_ERROR_OUT_OF_HOST_MEMORY, "doing this: "},
      {VK_ERROR_INITIALIZATION_FAILED, "doing this: "},
      {VK_ERROR_INCOMPATIBLE_DRIVER, "install"},
      {VK_ERROR_LAYER_NOT_PRESENT, "PALPATE_VALIDATION"},
      {VK_ERROR_FORMAT_NOT_SUPPORTED, "-11"}};
  for (const auto& [error, words] : errors) {
    const std::string message = error_of(Fault::system, [&] { check(error, "doing this"); });
    EXPECT_TRUE(message.starts_with("doing this: ")) << message;
    expect_named(message, {words});
  }
}

// The ranks of the Vulkan device types.
enum Rank { discrete, integrated, virtual_gpu, cpu };

Candidate usable(int index, Rank rank, const std::string& name) {
  return {.rank = rank, .info = {.index = index, .name = name, .usable = true}};
}

Candidate unusable(int index, Rank rank, const std::string& name, const std::string& reason) {
  return {.rank = rank, .info = {.index = index, .name = name, .reason = reason}};
}

/// A machine with one usable device of each type, the best of which is neither first nor last, and
/// one that would be as good, were it usable.
std::vector<Candidate> one_of_each() {
  return {usable(0, cpu, "llvmpipe (LLVM 15)"), usable(1, integrated, "Intel UHD 770"),
          usable(2, discrete, "NVIDIA RTX A2000"), usable(3, virtual_gpu, "Virtio GPU Venus"),
          unusable(4, discrete, "Radeon HD", "has no compute queue")};
}

/// Index of the chosen device; -1 if none is chosen.
int choice(std::vector<Candidate>& candidates, std::string_view wish = {}) {
  choose(candidates, wish);
  int found = -1;
  for (const Candidate& candidate : candidates) {
    EXPECT_FALSE(candidate.info.reason.empty()) << candidate.info.name << " has no reason";
    if (candidate.info.chosen) {
      EXPECT_EQ(found, -1) << "two are chosen";
      found = candidate.info.index;
      EXPECT_EQ(chosen(candidates, wish).info.index, found);
    }
  }
  return found;
}

TEST(Choose, PrefersDiscreteToIntegratedToVirtualToCpuAndLeavesTheUnusable) {
  std::vector<int> left{2, 1, 3, 0};
  std::vector<Candidate> candidates = one_of_each();
  std::mt19937 random(1);
  while (!left.empty()) {
    std::shuffle(candidates.begin(), candidates.end(), random);
    std::vector<Candidate> trial = candidates;
    EXPECT_EQ(choice(trial), left.front());
    std::erase_if(candidates, [&](const Candidate& c) { return c.info.index == left.front(); });
    left.erase(left.begin());
  }
}

TEST(Choose, SaysWhyEachOneIsOrIsNotTaken) {
  std::vector<Candidate> candidates = one_of_each();
  candidates.push_back(usable(5, discrete, "NVIDIA RTX A2000"));
  EXPECT_EQ(choice(candidates), 2) << "the first of two equals";
  EXPECT_EQ(candidates[2].info.reason, "the best usable device");
  EXPECT_NE(candidates[0].info.reason.find("ranks behind device 2"), std::string::npos);
  EXPECT_EQ(candidates[4].info.reason, "has no compute queue");
  EXPECT_NE(candidates[5].info.reason.find("as good as device 2"), std::string::npos);
}

TEST(Choose, TakesADeviceByIndexOrByAPartOfItsNameInAnyCase) {
  // A number is an index even where a name has it: otherwise a wrong index would open a device
  // whose name has the digit. Of all that match, the best is taken.
  const std::pair<std::string, int> wishes[] = {
      {"0", 0},    {"1", 1},       {"2", 2},       {"3", 3},    {"15", -1},
      {"4", -1},   {"-1", -1},     {"radeon", -1}, {"i", 2},    {"llvmpipe", 0},
      {"LLVM", 0}, {"uhd 770", 1}, {"nvidia", 2},  {"venus", 3}};
  for (const auto& [wish, index] : wishes) {
    SCOPED_TRACE(wish);
    std::vector<Candidate> candidates = one_of_each();
    EXPECT_EQ(choice(candidates, wish), index);
    if (index >= 0 && wish.size() > 1) {
      expect_named(candidates[static_cast<std::size_t>(index)].info.reason, {wish.c_str()});
    }
  }
}

std::string refusal(std::vector<Candidate> candidates, std::string_view wish, Fault fault) {
  choose(candidates, wish);
  return error_of(fault, [&] { chosen(candidates, wish); });
}

TEST(Chosen, NamesEveryDeviceWithItsReasonWhereNoneFits) {
  const std::vector<Candidate> candidates = one_of_each();
  const std::string message = refusal(candidates, "radeon", Fault::input);
  for (const Candidate& candidate : candidates) {
    expect_named(message, {candidate.info.name.c_str()});
  }
  expect_named(message, {"does not match 'radeon'", "has no compute queue"});
}

TEST(Chosen, WithoutAWishTheMachineIsAtFault) {
  const std::string message =
      refusal({unusable(0, discrete, "Old GPU", "has no compute queue")}, {}, Fault::system);
  expect_named(message, {"Old GPU"});
  EXPECT_EQ(message.find("''"), std::string::npos) << "speaks of a wish: " << message;
  for (const char* wish : {"", "nvidia"}) {
    expect_named(refusal({}, wish, Fault::system), {"install libvulkan1"});
  }
}

TEST(DeviceMemory, IsTheLargestHeapOfTheDevice) {
  VkPhysicalDeviceMemoryProperties memory{};
  memory.memoryHeapCount = 3;
  memory.memoryHeaps[0] = {.size = 64, .flags = 0};
  memory.memoryHeaps[1] = {.size = 8, .flags = VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
  memory.memoryHeaps[2] = {.size = 16, .flags = VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
  EXPECT_EQ(device_memory(memory), 16U);
}

TEST(Wished, IsTheEnvironmentsWhereNothingIsNamed) {
  for (const std::optional<std::string>& named : {std::optional<std::string>(), {"llvmpipe"}}) {
    const Variable device("PALPATE_DEVICE", named);
    EXPECT_EQ(wished(""), named.value_or(""));
    EXPECT_EQ(wished("0"), "0");
  }
}

}  // namespace palpate::gpu::device_test
