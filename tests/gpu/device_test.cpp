#include "palpate/device.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include <link.h>

#include "gpu/context.hpp"
#include "gpu/owned.hpp"
#include "support/errors.hpp"
#include "support/variable.hpp"

namespace palpate::device_test {

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
  gpu::Context* const context = &first.context();
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

TEST(Context, HasTheLimitsThatVulkanGuarantees) {
  Device device = Device::open();
  const gpu::Limits& limits = device.context().limits();
  EXPECT_GE(limits.storage_range, 1U << 27);
  EXPECT_GE(limits.allocation, 1U << 30);
  EXPECT_GE(limits.push_bytes, 128U);
  EXPECT_GT(limits.memory, 0U);
  for (const std::uint32_t groups : limits.group_count) {
    EXPECT_GE(groups, 65535U);
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

using gpu::check;

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

}  // namespace palpate::device_test
