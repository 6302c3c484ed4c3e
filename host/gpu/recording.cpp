#include "gpu/recording.hpp"

#include "gpu/vulkan.hpp"

namespace palpate::gpu {

void Recording::dispatch(const Kernel& kernel, VkDescriptorSet buffers,
                         std::span<const std::byte> push,
                         const std::array<std::uint32_t, 3>& groups, double work) {
  const std::size_t push_first = push_.size();
  push_.insert(push_.end(), push.begin(), push.end());
  commands_.emplace_back(Dispatch{kernel.pipeline(), kernel.layout(), buffers, push_first,
                                  static_cast<std::uint32_t>(push.size()), groups});
  work_ += work;
}

void Recording::clear() {
  commands_.clear();
  push_.clear();
  work_ = 0.0;
}

void Recording::encode(std::size_t command, VkCommandBuffer to) const {
  // A visitor may throw, as far as its signature tells, and nothing may be thrown here.
  if (const auto* copy = std::get_if<Copy>(&commands_[command])) {
    encode(*copy, to);
  } else if (const auto* fill = std::get_if<Fill>(&commands_[command])) {
    encode(*fill, to);
  } else {
    encode(*std::get_if<Dispatch>(&commands_[command]), to);
  }
}

void Recording::encode(const Copy& copy, VkCommandBuffer to) {
  vkCmdCopyBuffer(to, copy.source, copy.target, 1, &copy.region);
}

void Recording::encode(const Fill& fill, VkCommandBuffer to) {
  vkCmdFillBuffer(to, fill.target, 0, VK_WHOLE_SIZE, fill.word);
}

void Recording::encode(const Dispatch& dispatch, VkCommandBuffer to) const {
  vkCmdBindPipeline(to, VK_PIPELINE_BIND_POINT_COMPUTE, dispatch.pipeline);
  vkCmdBindDescriptorSets(to, VK_PIPELINE_BIND_POINT_COMPUTE, dispatch.layout, 0, 1,
                          &dispatch.buffers, 0, nullptr);
  vkCmdPushConstants(to, dispatch.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, dispatch.push_bytes,
                     push_.data() + dispatch.push_first);
  vkCmdDispatch(to, dispatch.groups[0], dispatch.groups[1], dispatch.groups[2]);
}

}  // namespace palpate::gpu
