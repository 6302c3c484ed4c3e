#pragma once

#include <string_view>

#include "context.hpp"
#include "owned.hpp"

namespace palpate::gpu {

/// Where a buffer lives. Data always travels through staging memory, also where a device could
/// map its own: one path for every machine, which the tests on a CPU device exercise too.
enum class Memory {
  device,    ///< storage of kernels; the host cannot see it
  upload,    ///< host memory, mapped, that the device copies from
  download,  ///< host memory, mapped, that the device copies to
};

/// What a buffer of this many bytes takes of the device's memory, rounded up as drivers do.
constexpr VkDeviceSize allocated(VkDeviceSize bytes) { return (bytes + 255) / 256 * 256; }

/// A Vulkan buffer with memory of its own. Move-only.
class Buffer {
 public:
  Buffer() = default;
  /// @param purpose what it holds, for the message when memory runs out
  /// @param texel the format as which kernels read it where they bind it as a table; device memory
  /// only
  Buffer(Context& context, VkDeviceSize bytes, Memory memory, std::string_view purpose,
         VkFormat texel = VK_FORMAT_UNDEFINED);

  VkBuffer handle() const { return buffer_.get(); }
  /// Null without a texel format.
  VkBufferView table() const { return table_.get(); }
  VkDeviceSize bytes() const { return bytes_; }
  /// Start of the mapped memory; null for Memory::device.
  std::byte* data() const { return data_; }

 private:
  struct GiveBack {
    VkDeviceSize bytes;
    void operator()(Context* context) const { context->give_memory(bytes); }
  };

  std::unique_ptr<Context, GiveBack> counted_;  ///< what the context counts of it
  Owned<VkDeviceMemory, vkFreeMemory> memory_;
  Owned<VkBuffer, vkDestroyBuffer> buffer_;
  Owned<VkBufferView, vkDestroyBufferView> table_;
  VkDeviceSize bytes_ = 0;
  std::byte* data_ = nullptr;
};

}  // namespace palpate::gpu
