#pragma once

#include <array>
#include <cstring>
#include <initializer_list>
#include <ranges>
#include <span>
#include <vector>

#include "gpu/buffer.hpp"
#include "gpu/kernel.hpp"
#include "gpu/owned.hpp"

namespace palpate::gpu {

/// Records copies and dispatches, then runs them in order. A barrier stands between any two
/// commands, so that each sees the results of all before it. Buffers and kernels must live until
/// then. Each thread has streams of its own, which take turns on the device: they must share no
/// buffer that one of them writes. Staging memory has a fixed
/// size: a copy that finds it full first runs the recorded commands. A call that throws drops all
/// recorded commands, so that no later run uses a buffer that the caller has freed meanwhile.
class CommandStream {
 public:
  /// Size of the staging memory, both directions together, in bytes.
  static constexpr VkDeviceSize staging_bytes = 8 << 20;

  explicit CommandStream(Context& context);
  CommandStream(const CommandStream&) = delete;
  CommandStream& operator=(const CommandStream&) = delete;

  /// Copies the values to the buffer, from byte `offset` on. Reads `values` before it returns.
  template <std::ranges::contiguous_range Values>
  void upload(const Buffer& target, const Values& values, VkDeviceSize offset = 0) {
    upload_bytes(target, std::as_bytes(std::span(values)), offset);
  }
  /// Makes a buffer of the device and copies the values to it.
  template <std::ranges::contiguous_range Values>
  Buffer uploaded(const Values& values, std::string_view purpose,
                  VkFormat texel = VK_FORMAT_UNDEFINED) {
    return uploaded_bytes(std::as_bytes(std::span(values)), purpose, texel);
  }
  /// Copies from the buffer, from byte `offset` on. `values` must live until run() fills them.
  template <std::ranges::contiguous_range Values>
  void download(const Buffer& source, Values&& values, VkDeviceSize offset = 0) {
    download_bytes(source, std::as_writable_bytes(std::span(values)), offset);
  }
  /// Sets every 32-bit word of the buffer to `word`.
  void fill(const Buffer& target, std::uint32_t word);

  /// Runs a kernel on groups[0] x groups[1] x groups[2] workgroups, with a buffer for each of its
  /// bindings: null for storage, or a table of floats, that its constants keep it from reading.
  template <typename Push>
  void dispatch(const Kernel& kernel, std::initializer_list<const Buffer*> buffers,
                const Push& push, std::array<std::uint32_t, 3> groups) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatch_bytes(kernel, std::span(buffers.begin(), buffers.size()),
                   std::as_bytes(std::span(&push, 1)), groups);
  }

  /// Submits everything recorded, waits for it and delivers the downloads.
  void run();

  /// Time that the device took for all commands of the last run(), in seconds. A device may take
  /// turns between the commands of several streams: then that of their turns, too.
  double device_seconds() const { return device_seconds_; }

 private:
  struct Download {
    std::byte* target;
    const std::byte* source;
    std::size_t bytes;
  };
  /// Staging memory of one direction, filled from front to back and reused after every run.
  struct Arena {
    Memory memory;
    Buffer block;
    VkDeviceSize used = 0;
  };

  /// Makes room at arena.used for a copy. Returns how many of its `bytes` fit, at least one.
  std::size_t stage(Arena& arena, std::size_t bytes);
  Buffer uploaded_bytes(std::span<const std::byte> bytes, std::string_view purpose, VkFormat texel);
  void upload_bytes(const Buffer& target, std::span<const std::byte> bytes, VkDeviceSize offset);
  void download_bytes(const Buffer& source, std::span<std::byte> bytes, VkDeviceSize offset);
  void dispatch_bytes(const Kernel& kernel, std::span<const Buffer* const> buffers,
                      std::span<const std::byte> push, std::array<std::uint32_t, 3> groups);
  /// The command buffer, behind a barrier.
  VkCommandBuffer next_command();
  /// Calls `commands`, which add to the command buffer. Drops what is recorded if they throw.
  template <typename Commands>
  void record(const Commands& commands);
  void run_recorded();
  /// Runs the command buffer and waits for it. Returns the device's time, in seconds.
  double execute();
  void rewind();
  void drop();
  VkDescriptorSet descriptor_set(const Kernel& kernel, std::span<const Buffer* const> buffers);
  /// Returns the buffer for bindings that a kernel does not read, where Vulkan wants one, too.
  const Buffer& unread();

  Context& context_;
  Owned<VkCommandPool> pool_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  bool recording_ = false;  ///< there are commands to run
  Owned<VkFence> fence_;
  Owned<VkQueryPool> timestamps_;  ///< none where the queue has none
  std::vector<Owned<VkDescriptorPool>> descriptor_pools_;
  std::size_t sets_used_ = 0;
  Buffer unread_;
  Arena upload_{Memory::upload, {}, 0};
  Arena download_{Memory::download, {}, 0};
  std::vector<Download> downloads_;
  double device_seconds_ = 0.0;
  double seconds_before_run_ = 0.0;  ///< device time since the last run()
};

}  // namespace palpate::gpu
