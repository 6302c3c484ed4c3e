#include <cstdio>

#include "palpate/device.hpp"
#include "support/errors.hpp"
#include "support/variable.hpp"

namespace palpate::vulkan_test {

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

}  // namespace palpate::vulkan_test
