#include "gpu/submitter.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

#include "gpu/recording.hpp"
#include "gpu/vulkan.hpp"

namespace palpate::gpu {

namespace {

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

Submitter::Submitter(Context& context) : context_(context) {
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

VkResult Submitter::encode(const WaitingRun& first) {
  const VkCommandBufferBeginInfo info{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                      .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
  if (const VkResult result = vkBeginCommandBuffer(commands_, &info); result != VK_SUCCESS) {
    return result;
  }
  if (timestamps_) {
    vkCmdResetQueryPool(commands_, timestamps_.get(), 0, 2);
    vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, timestamps_.get(), 0);
  }
  std::size_t most = 0;
  for (const WaitingRun* run = &first; run != nullptr; run = run->next) {
    most = std::max(most, run->recording->commands());
  }
  for (std::size_t command = 0; command < most; ++command) {
    barrier(commands_);
    for (const WaitingRun* run = &first; run != nullptr; run = run->next) {
      if (command < run->recording->commands()) {
        run->recording->encode(command, commands_);
      }
    }
  }
  barrier_to_host(commands_);
  if (timestamps_) {
    vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, timestamps_.get(), 1);
  }
  return vkEndCommandBuffer(commands_);
}

RunOutcome Submitter::run(const WaitingRun& first) noexcept {
  const VkDevice device = context_.device();
  const VkFence fence = fence_.get();
  if (const VkResult result = vkResetCommandPool(device, pool_.get(), 0); result != VK_SUCCESS) {
    return {result};
  }
  if (const VkResult result = vkResetFences(device, 1, &fence); result != VK_SUCCESS) {
    return {result};
  }
  if (const VkResult result = encode(first); result != VK_SUCCESS) {
    return {result};
  }
  const VkSubmitInfo submit{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                            .commandBufferCount = 1,
                            .pCommandBuffers = &commands_};
  const auto start = std::chrono::steady_clock::now();
  if (const VkResult result = context_.submit(submit, fence); result != VK_SUCCESS) {
    return {result};
  }
  VkResult result =
      vkWaitForFences(device, 1, &fence, VK_TRUE, std::numeric_limits<std::uint64_t>::max());
  double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (result == VK_SUCCESS && timestamps_) {
    std::array<std::uint64_t, 2> ticks{};
    result =
        vkGetQueryPoolResults(device, timestamps_.get(), 0, 2, sizeof ticks, ticks.data(),
                              sizeof ticks[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
    seconds = static_cast<double>((ticks[1] - ticks[0]) & context_.limits().timestamp_mask) *
              context_.limits().timestamp_ns * 1e-9;
  }
  return {result, seconds};
}

}  // namespace palpate::gpu
