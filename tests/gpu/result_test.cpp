#include "gpu/owned.hpp"
#include "support/errors.hpp"

namespace palpate::gpu::result_test {

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

}  // namespace palpate::gpu::result_test
