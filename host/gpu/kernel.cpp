#include "gpu/kernel.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "gpu/context.hpp"
#include "gpu/selection.hpp"
#include "gpu/vulkan.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

VkDescriptorType descriptor_type(Access access) {
  return access == Access::table ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                                 : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}

namespace {

/// Several filters of all kinds have as many; a program that makes ever other ones keeps no more.
constexpr std::size_t most_kept = 64;

bool same(const KernelInfo& a, const KernelInfo& b) {
  return a.spirv.data() == b.spirv.data() && a.bindings == b.bindings &&
         a.push_bytes == b.push_bytes && a.constants == b.constants;
}

Pipeline compiled(Context& context, const KernelInfo& info, std::string_view doing) {
  const VkDevice device = context.device();
  Pipeline made{.info = info};
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  for (const Access access : info.bindings) {
    bindings.push_back({.binding = static_cast<std::uint32_t>(bindings.size()),
                        .descriptorType = descriptor_type(access),
                        .descriptorCount = 1,
                        .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
  }
  const VkDescriptorSetLayoutCreateInfo set_info{
      .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
      .bindingCount = static_cast<std::uint32_t>(bindings.size()),
      .pBindings = bindings.data()};
  made.set_layout = make_owned(vkCreateDescriptorSetLayout, vkDestroyDescriptorSetLayout, device,
                               set_info, doing);
  const VkDescriptorSetLayout set_layout = made.set_layout.get();

  const VkPushConstantRange push{.stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                 .size = info.push_bytes};
  const VkPipelineLayoutCreateInfo layout_info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
      .setLayoutCount = 1,
      .pSetLayouts = &set_layout,
      .pushConstantRangeCount = info.push_bytes > 0 ? 1U : 0U,
      .pPushConstantRanges = &push};
  made.layout =
      make_owned(vkCreatePipelineLayout, vkDestroyPipelineLayout, device, layout_info, doing);

  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < info.constants.size(); ++i) {
    entries.push_back({.constantID = i, .offset = i * 4, .size = 4});
  }
  const VkSpecializationInfo specialization{
      .mapEntryCount = static_cast<std::uint32_t>(entries.size()),
      .pMapEntries = entries.data(),
      .dataSize = info.constants.size() * sizeof(std::uint32_t),
      .pData = info.constants.data()};
  const VkShaderModuleCreateInfo module_info{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                             .codeSize = info.spirv.size_bytes(),
                                             .pCode = info.spirv.data()};
  const auto module =
      make_owned(vkCreateShaderModule, vkDestroyShaderModule, device, module_info, doing);
  const VkComputePipelineCreateInfo pipeline_info{
      .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
      .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                .module = module.get(),
                .pName = "main",
                .pSpecializationInfo = &specialization},
      .layout = made.layout.get()};
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &pipeline_info, nullptr, &pipeline),
        doing);
  made.pipeline = {pipeline, {device, vkDestroyPipeline}};
  context.validation().throw_if_any();
  return made;
}

}  // namespace

std::shared_ptr<const Pipeline> Pipelines::get(const KernelInfo& info,
                                               const std::function<Pipeline()>& make) {
  // Whoever needs the same one at the same time waits for it.
  const std::scoped_lock lock(mutex_);
  const auto found =
      std::ranges::find_if(kept_, [&](const auto& pipeline) { return same(pipeline->info, info); });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
  } else {
    kept_.push_front(std::make_shared<const Pipeline>(make()));
    kept_.resize(std::min(kept_.size(), most_kept));
  }
  return kept_.front();
}

void Pipelines::clear() { kept_.clear(); }

Kernel::Kernel(Context& context, const KernelInfo& info) {
  const auto doing = fmt::format("device '{}': kernel {}", context.name(), info.name);
  if (info.push_bytes > context.limits().push_bytes || info.bindings.size() > max_bindings) {
    throw Error(Fault::system, fmt::format("{}: needs {} B of push constants and {} buffers, more "
                                           "than the device has",
                                           doing, info.push_bytes, info.bindings.size()));
  }
  pipeline_ = context.pipelines().get(info, [&] { return compiled(context, info, doing); });
}

}  // namespace palpate::gpu
