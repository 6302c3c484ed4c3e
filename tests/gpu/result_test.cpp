#include "gpu/owned.hpp"

#include <string>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate::gpu::result_test {

std::string message_of(VkResult result) {
  try {
    check(result, "doing this");
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::system);
    return error.what();
  }
  ADD_FAILURE() << "no error for VkResult " << result;
  return {};
}

TEST(Result, SuccessPasses) { EXPECT_NO_THROW(check(VK_SUCCESS, "doing this")); }

TEST(Result, EveryErrorIsOneLineThatSaysWhatWasDone) {
  for (const VkResult result :
       {VK_ERROR_DEVICE_LOST, VK_ERROR_OUT_OF_DEVICE_MEMORY, VK_ERROR_OUT_OF_HOST_MEMORY,
        VK_ERROR_INITIALIZATION_FAILED, VK_ERROR_INCOMPATIBLE_DRIVER, VK_ERROR_LAYER_NOT_PRESENT,
        VK_ERROR_FORMAT_NOT_SUPPORTED}) {
    const std::string message = message_of(result);
    EXPECT_EQ(message.rfind("doing this: ", 0), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(Result, WhatAUserCanMendComesWithTheRemedy) {
  const auto says = [](VkResult result, const std::string& text) {
    EXPECT_NE(message_of(result).find(text), std::string::npos) << message_of(result);
  };
  says(VK_ERROR_DEVICE_LOST, "the device was lost");
  says(VK_ERROR_DEVICE_LOST, "fewer bins");
  says(VK_ERROR_OUT_OF_DEVICE_MEMORY, "out of device memory");
  says(VK_ERROR_OUT_OF_DEVICE_MEMORY, "fewer bins");
  says(VK_ERROR_INCOMPATIBLE_DRIVER, "install");
  says(VK_ERROR_LAYER_NOT_PRESENT, "PALPATE_VALIDATION");
  says(VK_ERROR_FORMAT_NOT_SUPPORTED, "-11");
}

}  // namespace palpate::gpu::result_test
