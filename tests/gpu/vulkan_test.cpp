#include <cstdio>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "palpate/device.hpp"
#include "palpate/error.hpp"

namespace palpate::vulkan_test {

/// Opens devices in a process that has not loaded Vulkan; ends it with 3 where each attempt fails
/// as the machine's fault, and says why.
[[noreturn]] void open_with(const char* library) {
  int refused = 0;
  setenv("PALPATE_VULKAN_LIBRARY", library, 1);
  for (const bool list : {false, true}) {
    try {
      list ? static_cast<void>(Device::list()) : static_cast<void>(Device::open());
    } catch (const Error& error) {
      refused += error.fault() == Fault::system ? 1 : 0;
      std::fprintf(stderr, "%s\n", error.what());
    }
  }
  std::exit(refused == 2 ? 3 : 4);
}

class VulkanDeathTest : public testing::Test {
 protected:
  // Each child starts anew: this process may have Vulkan.
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(VulkanDeathTest, AMissingLoaderIsAnErrorThatNamesThePackages) {
  EXPECT_EXIT(open_with("/nonexistent/libvulkan.so.1"), testing::ExitedWithCode(3),
              "^Vulkan cannot be loaded: /nonexistent/libvulkan.so.1: [^\n]*; on Debian, install "
              "libvulkan1 and mesa-vulkan-drivers\n");
}

TEST_F(VulkanDeathTest, ALibraryThatIsNoLoaderIsRefused) {
  EXPECT_EXIT(open_with("libm.so.6"), testing::ExitedWithCode(3),
              "^Vulkan cannot be loaded: libm.so.6 is no loader of Vulkan 1.1; ");
}

TEST_F(VulkanDeathTest, ALaterCallTriesAgain) {
  const auto open_twice = [] {
    setenv("PALPATE_VULKAN_LIBRARY", "/nonexistent/libvulkan.so.1", 1);
    try {
      Device::open();
    } catch (const Error&) {
      unsetenv("PALPATE_VULKAN_LIBRARY");
      std::exit(Device::open().name().empty() ? 4 : 3);
    }
    std::exit(5);
  };
  EXPECT_EXIT(open_twice(), testing::ExitedWithCode(3), "");
}

}  // namespace palpate::vulkan_test
