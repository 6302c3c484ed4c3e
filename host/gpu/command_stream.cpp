#include "gpu/command_stream.hpp"

#include <algorithm>
#include <chrono>
#include <limits>

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

/// Lets what follows see the results of all commands before. The only barrier between commands.
void barrier(VkCommandBuffer commands) {
  constexpr VkPipelineStageFlags stages =
      VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  const VkMemoryBarrier memory{
      .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
      .srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT,
      .dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                       VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT};
  vkCmdPipelineBarrier(commands, stages, stages, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

/// Makes the device's writes to staging memory visible to the host after the fence.
void barrier_to_host(VkCommandBuffer commands) {
  const VkMemoryBarrier memory{.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                               .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT,
                               .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
  vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1,
                       &memory, 0, nullptr, 0, nullptr);
}

}  // namespace

CommandStream::CommandStream(Context& context) : context_(context) {
  const VkDevice device = context.device();
  const VkCommandPoolCreateInfo pool_info{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                          .queueFamilyIndex = context.queue_family()};
  pool_ = make_owned(vkCreateCommandPool, vkDestroyCommandPool, device, pool_info,
                     "creating a command pool");
  const VkCommandBufferAllocateInfo buffer_info{
      .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
      .commandPool = pool_.get(),
      .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
      .commandBufferCount = 1};
  check(vkAllocateCommandBuffers(device, &buffer_info, &commands_), "creating commands");
  const VkFenceCreateInfo fence_info{.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
  fence_ = make_owned(vkCreateFence, vkDestroyFence, device, fence_info, "creating a fence");
  if (context.limits().timestamp_ns > 0.0F) {
    const VkQueryPoolCreateInfo query_info{.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                           .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                           .queryCount = 2};
    timestamps_ = make_owned(vkCreateQueryPool, vkDestroyQueryPool, device, query_info,
                             "creating timestamps");
  }
}

VkCommandBuffer CommandStream::next_command() {
  if (!recording_) {
    check(vkResetCommandPool(context_.device(), pool_.get(), 0), "resetting commands");
    const VkCommandBufferBeginInfo info{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                        .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    check(vkBeginCommandBuffer(commands_, &info), "recording commands");
    recording_ = true;
    if (timestamps_) {
      vkCmdResetQueryPool(commands_, timestamps_.get(), 0, 2);
      vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, timestamps_.get(), 0);
    }
  }
  barrier(commands_);
  return commands_;
}

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
      const VkBufferCopy region{upload_.used, offset, count};
      vkCmdCopyBuffer(next_command(), upload_.block.handle(), target.handle(), 1, &region);
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
      const VkBufferCopy region{offset, download_.used, count};
      vkCmdCopyBuffer(next_command(), source.handle(), download_.block.handle(), 1, &region);
      downloads_.push_back({bytes.data(), download_.block.data() + download_.used, count});
      download_.used += staged(count);
      bytes = bytes.subspan(count);
      offset += count;
    });
  }
}

void CommandStream::fill(const Buffer& target, std::uint32_t word) {
  record([&] { vkCmdFillBuffer(next_command(), target.handle(), 0, VK_WHOLE_SIZE, word); });
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
                                   std::array<std::uint32_t, 3> groups) {
  record([&] {
    const auto& limit = context_.limits().group_count;
    if (buffers.size() != kernel.bindings().size() || push.size() != kernel.push_bytes() ||
        groups[0] > limit[0] || groups[1] > limit[1] || groups[2] > limit[2]) {
      throw Error(
          Fault::system,
          fmt::format("kernel {}: {} buffers, {} B of constants and {} x {} x {} workgroups "
                      "do not fit it or the device",
                      kernel.name(), buffers.size(), push.size(), groups[0], groups[1], groups[2]));
    }
    const VkDescriptorSet set = descriptor_set(kernel, buffers);
    const VkCommandBuffer commands = next_command();
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.pipeline());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, kernel.layout(), 0, 1, &set,
                            0, nullptr);
    vkCmdPushConstants(commands, kernel.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                       static_cast<std::uint32_t>(push.size()), push.data());
    vkCmdDispatch(commands, groups[0], groups[1], groups[2]);
  });
}

void CommandStream::run() {
  if (!recording_) {
    return;
  }
  run_recorded();
  device_seconds_ = seconds_before_run_;
  seconds_before_run_ = 0.0;
}

void CommandStream::run_recorded() {
  record([&] { seconds_before_run_ += execute(); });
  for (const Download& download : downloads_) {
    std::memcpy(download.target, download.source, download.bytes);
  }
  rewind();
  context_.validation().throw_if_any();
}

double CommandStream::execute() {
  const VkDevice device = context_.device();
  const VkFence fence = fence_.get();
  const auto require = [this](VkResult result) {
    if (result != VK_SUCCESS) {  // no message is made while all goes well
      check(result, fmt::format("running on device '{}'", context_.name()));
    }
  };
  barrier_to_host(commands_);
  if (timestamps_) {
    vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, timestamps_.get(), 1);
  }
  require(vkEndCommandBuffer(commands_));
  require(vkResetFences(device, 1, &fence));
  const VkSubmitInfo submit{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                            .commandBufferCount = 1,
                            .pCommandBuffers = &commands_};
  const auto start = std::chrono::steady_clock::now();
  require(context_.submit(submit, fence));
  require(vkWaitForFences(device, 1, &fence, VK_TRUE, std::numeric_limits<std::uint64_t>::max()));
  if (!timestamps_) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  std::array<std::uint64_t, 2> ticks{};
  require(vkGetQueryPoolResults(device, timestamps_.get(), 0, 2, sizeof ticks, ticks.data(),
                                sizeof ticks[0],
                                VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
  return static_cast<double>((ticks[1] - ticks[0]) & context_.limits().timestamp_mask) *
         context_.limits().timestamp_ns * 1e-9;
}

void CommandStream::drop() {
  seconds_before_run_ = 0.0;
  rewind();
}

void CommandStream::rewind() {
  const VkDevice device = context_.device();
  recording_ = false;
  downloads_.clear();
  for (const auto& pool : descriptor_pools_) {
    check(vkResetDescriptorPool(device, pool.get(), 0), "resetting a descriptor pool");
  }
  sets_used_ = 0;
  upload_.used = 0;
  download_.used = 0;
}

}  // namespace palpate::gpu
