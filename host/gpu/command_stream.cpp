#include "gpu/command_stream.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "gpu/selection.hpp"
#include "gpu/vulkan.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

namespace {

constexpr std::uint32_t sets_per_pool = 64;
constexpr VkDeviceSize staging_block = CommandStream::staging_bytes / 2;

/// Staging memory that a copy takes: copies start at multiples of 16 bytes.
VkDeviceSize staged(VkDeviceSize bytes) { return (bytes + 15) / 16 * 16; }

}  // namespace

CommandStream::CommandStream(Context& context) : context_(context), submitter_(context) {}

template <typename Commands>
void CommandStream::record(const Commands& commands) {
  try {
    commands();
  } catch (...) {
    drop();
    throw;
  }
}

std::size_t CommandStream::stage(Arena& arena, std::size_t bytes) {
  if (arena.block.bytes() == 0) {
    arena.block = Buffer(context_, staging_block, arena.memory, "staging");
  }
  // Small copies are not split in two.
  const VkDeviceSize room = staging_block - arena.used;
  if (room < std::min<VkDeviceSize>(bytes, staging_block / 4)) {
    run_recorded();
  }
  return std::min<std::size_t>(bytes, staging_block - arena.used);
}

Buffer CommandStream::uploaded_bytes(std::span<const std::byte> bytes, std::string_view purpose,
                                     VkFormat texel) {
  Buffer buffer;
  record([&] { buffer = Buffer(context_, bytes.size(), Memory::device, purpose, texel); });
  upload_bytes(buffer, bytes, 0);
  return buffer;
}

void CommandStream::upload_bytes(const Buffer& target, std::span<const std::byte> bytes,
                                 VkDeviceSize offset) {
  while (!bytes.empty()) {
    record([&] {
      const std::size_t count = stage(upload_, bytes.size());
      std::memcpy(upload_.block.data() + upload_.used, bytes.data(), count);
      recording_.copy(upload_.block.handle(), target.handle(), {upload_.used, offset, count});
      upload_.used += staged(count);
      bytes = bytes.subspan(count);
      offset += count;
    });
  }
}

void CommandStream::download_bytes(const Buffer& source, std::span<std::byte> bytes,
                                   VkDeviceSize offset) {
  while (!bytes.empty()) {
    record([&] {
      const std::size_t count = stage(download_, bytes.size());
      recording_.copy(source.handle(), download_.block.handle(), {offset, download_.used, count});
      downloads_.push_back({bytes.data(), download_.block.data() + download_.used, count});
      download_.used += staged(count);
      bytes = bytes.subspan(count);
      offset += count;
    });
  }
}

void CommandStream::fill(const Buffer& target, std::uint32_t word) {
  record([&] { recording_.fill(target.handle(), word); });
}

VkDescriptorSet CommandStream::descriptor_set(const Kernel& kernel,
                                              std::span<const Buffer* const> buffers) {
  const VkDevice device = context_.device();
  if (sets_used_ == descriptor_pools_.size() * sets_per_pool) {
    const VkDescriptorPoolSize sizes[] = {
        {descriptor_type(Access::table), sets_per_pool * max_bindings},
        {descriptor_type(Access::storage), sets_per_pool * max_bindings}};
    const VkDescriptorPoolCreateInfo info{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                          .maxSets = sets_per_pool,
                                          .poolSizeCount = 2,
                                          .pPoolSizes = sizes};
    descriptor_pools_.push_back(make_owned(vkCreateDescriptorPool, vkDestroyDescriptorPool, device,
                                           info, "creating a descriptor pool"));
  }
  const VkDescriptorSetLayout layout = kernel.set_layout();
  const VkDescriptorSetAllocateInfo info{
      .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
      .descriptorPool = descriptor_pools_[sets_used_ / sets_per_pool].get(),
      .descriptorSetCount = 1,
      .pSetLayouts = &layout};
  VkDescriptorSet set = VK_NULL_HANDLE;
  check(vkAllocateDescriptorSets(device, &info, &set), "binding buffers");
  ++sets_used_;

  std::array<VkDescriptorBufferInfo, max_bindings> ranges{};
  std::array<VkBufferView, max_bindings> tables{};
  std::array<VkWriteDescriptorSet, max_bindings> writes{};
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const Buffer& buffer = buffers[i] != nullptr ? *buffers[i] : unread();
    ranges[i] = {buffer.handle(), 0, VK_WHOLE_SIZE};
    tables[i] = buffer.table();
    writes[i] = {.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
                 .dstSet = set,
                 .dstBinding = static_cast<std::uint32_t>(i),
                 .descriptorCount = 1,
                 .descriptorType = descriptor_type(kernel.bindings()[i]),
                 .pBufferInfo = &ranges[i],
                 .pTexelBufferView = &tables[i]};
    if (kernel.bindings()[i] == Access::storage &&
        buffer.bytes() > context_.limits().storage_range) {
      throw Error(Fault::system,
                  fmt::format("kernel {}: binding {} of {} B exceeds the device's {} B",
                              kernel.name(), i, buffer.bytes(), context_.limits().storage_range));
    }
  }
  vkUpdateDescriptorSets(device, static_cast<std::uint32_t>(buffers.size()), writes.data(), 0,
                         nullptr);
  return set;
}

const Buffer& CommandStream::unread() {
  if (unread_.bytes() == 0) {
    unread_ = Buffer(context_, 16, Memory::device, "a binding", VK_FORMAT_R32G32B32A32_SFLOAT);
  }
  return unread_;
}

void CommandStream::dispatch_bytes(const Kernel& kernel, std::span<const Buffer* const> buffers,
                                   std::span<const std::byte> push,
                                   std::array<std::uint32_t, 3> groups, double work) {
  record([&] {
    const auto& most = context_.limits().group_count;
    if (buffers.size() != kernel.bindings().size() || push.size() != kernel.push_bytes() ||
        groups[0] > most[0] || groups[1] > most[1] || groups[2] > most[2]) {
      throw Error(
          Fault::system,
          fmt::format("kernel {}: {} buffers, {} B of constants and {} x {} x {} workgroups "
                      "do not fit it or the device",
                      kernel.name(), buffers.size(), push.size(), groups[0], groups[1], groups[2]));
    }
    recording_.dispatch(kernel, descriptor_set(kernel, buffers), push, groups, work);
  });
}

void CommandStream::run() {
  if (recording_.empty()) {
    return;
  }
  run_recorded();
  device_seconds_ = seconds_before_run_;
  seconds_before_run_ = 0.0;
}

void CommandStream::run_recorded() {
  try {
    submit();
  } catch (...) {
    drop();
    throw;
  }
  rewind();
  context_.validation().throw_if_any();
}

void CommandStream::submit() {
  const RunOutcome outcome = context_.runs().run(recording_, submitter_);
  if (outcome.result !=
      VK_SUCCESS) {  // no message is made, and no memory taken, while all goes well
    check(outcome.result, fmt::format("running on device '{}'", context_.name()));
  }
  seconds_before_run_ += outcome.seconds;
  for (const Download& download : downloads_) {
    std::memcpy(download.target, download.source, download.bytes);
  }
}

void CommandStream::drop() {
  seconds_before_run_ = 0.0;
  rewind();
}

void CommandStream::rewind() {
  const VkDevice device = context_.device();
  recording_.clear();
  downloads_.clear();
  for (const auto& pool : descriptor_pools_) {
    check(vkResetDescriptorPool(device, pool.get(), 0), "resetting a descriptor pool");
  }
  sets_used_ = 0;
  upload_.used = 0;
  download_.used = 0;
}

}  // namespace palpate::gpu
