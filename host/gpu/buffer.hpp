#pragma once

#include <string_view>

#include "context.hpp"

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
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Buffer();

  VkBuffer handle() const { return buffer_; }
  /// Null without a texel format.
  VkBufferView table() const { return table_; }
  VkDeviceSize bytes() const { return bytes_; }
  /// Start of the mapped memory; null for Memory::device.
  std::byte* data() const { return data_; }

 private:
  void swap(Buffer& other) noexcept;

  Context* context_ = nullptr;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkBufferView table_ = VK_NULL_HANDLE;
  VkDeviceSize bytes_ = 0;
  VkDeviceSize allocated_ = 0;
  std::byte* data_ = nullptr;
};

}  // namespace palpate::gpu
