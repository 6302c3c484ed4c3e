#include "kernel.hpp"

#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "result.hpp"
#include "selection.hpp"

namespace palpate::gpu {

VkDescriptorType descriptor_type(Access access) {
  return access == Access::table ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                                 : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
}

Kernel::Kernel(Context& context, const KernelInfo& info) {
  const auto doing = fmt::format("device '{}': kernel {}", context.name(), info.name);
  if (info.push_bytes > context.limits().push_bytes || info.bindings.size() > max_bindings) {
    throw Error(Fault::system, fmt::format("{}: needs {} B of push constants and {} buffers, more "
                                           "than the device has",
                                           doing, info.push_bytes, info.bindings.size()));
  }
  // A constructor that throws runs no destructor: `owner` frees what exists so far.
  Kernel owner;
  owner.device_ = context.device();
  owner.bindings_.assign(info.bindings.begin(), info.bindings.end());
  owner.push_bytes_ = info.push_bytes;
  owner.name_ = info.name;

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
  check(vkCreateDescriptorSetLayout(owner.device_, &set_info, nullptr, &owner.set_layout_), doing);

  const VkPushConstantRange push{.stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                 .size = info.push_bytes};
  const VkPipelineLayoutCreateInfo layout_info{
      .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
      .setLayoutCount = 1,
      .pSetLayouts = &owner.set_layout_,
      .pushConstantRangeCount = info.push_bytes > 0 ? 1U : 0U,
      .pPushConstantRanges = &push};
  check(vkCreatePipelineLayout(owner.device_, &layout_info, nullptr, &owner.layout_), doing);

  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < info.constants.size(); ++i) {
    entries.push_back({.constantID = i, .offset = i * 4, .size = 4});
  }
  const VkSpecializationInfo specialization{
      .mapEntryCount = static_cast<std::uint32_t>(entries.size()),
      .pMapEntries = entries.data(),
      .dataSize = info.constants.size_bytes(),
      .pData = info.constants.data()};
  const VkShaderModuleCreateInfo module_info{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                             .codeSize = info.spirv.size_bytes(),
                                             .pCode = info.spirv.data()};
  VkShaderModule module = VK_NULL_HANDLE;
  check(vkCreateShaderModule(owner.device_, &module_info, nullptr, &module), doing);
  const VkComputePipelineCreateInfo pipeline_info{
      .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
      .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                .module = module,
                .pName = "main",
                .pSpecializationInfo = &specialization},
      .layout = owner.layout_};
  const VkResult result = vkCreateComputePipelines(owner.device_, VK_NULL_HANDLE, 1, &pipeline_info,
                                                   nullptr, &owner.pipeline_);
  vkDestroyShaderModule(owner.device_, module, nullptr);
  check(result, doing);
  context.validation().throw_if_any();
  swap(owner);
}

Kernel::~Kernel() {
  if (device_ != VK_NULL_HANDLE) {
    vkDestroyPipeline(device_, pipeline_, nullptr);
    vkDestroyPipelineLayout(device_, layout_, nullptr);
    vkDestroyDescriptorSetLayout(device_, set_layout_, nullptr);
  }
}

void Kernel::swap(Kernel& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(set_layout_, other.set_layout_);
  std::swap(layout_, other.layout_);
  std::swap(pipeline_, other.pipeline_);
  std::swap(bindings_, other.bindings_);
  std::swap(push_bytes_, other.push_bytes_);
  std::swap(name_, other.name_);
}

}  // namespace palpate::gpu
