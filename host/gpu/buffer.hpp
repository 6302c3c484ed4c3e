#pragma once

#include <string_view>

#include "gpu/context.hpp"
#include "gpu/kernel.hpp"
#include "gpu/owned.hpp"

namespace palpate::gpu {

/// The memory of a buffer. Data always passes through staging memory, even where the host could map
/// the device's memory: all machines run the path that the tests run.
enum class Memory {
  device,    ///< read and written by kernels; the host cannot access it
  upload,    ///< mapped host memory that the device copies from
  download,  ///< mapped host memory that the device copies to
};

/// The texel's format for a buffer of this size that kernels read as a table where the device reads
/// so many texels, and VK_FORMAT_UNDEFINED where they read it from storage instead.
VkFormat table_where_it_fits(const Limits& limits, VkDeviceSize bytes, VkFormat texel);

/// A Vulkan buffer with memory of its own. Move-only.
class Buffer {
 public:
  Buffer() = default;
  /// @param purpose what the buffer holds, for the message when memory runs out
  /// @param texel format of the buffer as a table (Access::table); only for Memory::device
  /// @throws Error if the device does not have the memory, or reads no table of so many texels
  Buffer(Context& context, VkDeviceSize bytes, Memory memory, std::string_view purpose,
         VkFormat texel = VK_FORMAT_UNDEFINED);

  VkBuffer handle() const { return buffer_.get(); }
  /// The view that binds the buffer as a table; null without a texel format.
  VkBufferView table() const { return table_.get(); }
  bool is_table() const { return table_.get() != VK_NULL_HANDLE; }
  /// For the two bindings of a kernel that reads a buffer as a table or, as a constant of its tells
  /// it, from storage: the buffer for the binding that is read, null for the other.
  const Buffer* read_as(Access access) const {
    return is_table() == (access == Access::table) ? this : nullptr;
  }
  VkDeviceSize bytes() const { return bytes_; }
  /// Start of the mapped memory; null for Memory::device.
  std::byte* data() const { return data_; }

 private:
  struct GiveBack {
    VkDeviceSize bytes;
    void operator()(Context* context) const { context->give_memory(bytes); }
  };

  std::unique_ptr<Context, GiveBack> counted_;  ///< counts the buffer's memory
  Owned<VkDeviceMemory> memory_;
  Owned<VkBuffer> buffer_;
  Owned<VkBufferView> table_;
  VkDeviceSize bytes_ = 0;
  std::byte* data_ = nullptr;
};

}  // namespace palpate::gpu
