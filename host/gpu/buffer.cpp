#include "gpu/buffer.hpp"

#include <fmt/format.h>

#include "gpu/vulkan.hpp"
#include "palpate/error.hpp"

namespace palpate::gpu {

namespace {

VkDeviceSize bytes_per_texel(VkFormat texel) {
  switch (texel) {
    case VK_FORMAT_R32_SFLOAT:
      return 4;
    case VK_FORMAT_R32G32_SFLOAT:
      return 8;
    case VK_FORMAT_R32G32B32A32_SFLOAT:
    case VK_FORMAT_R32G32B32A32_SINT:
      return 16;
    default:  // no texel is smaller
      return 1;
  }
}

VkDeviceSize texels_of(VkDeviceSize bytes, VkFormat texel) {
  return bytes / bytes_per_texel(texel);
}

}  // namespace

VkFormat table_where_it_fits(const Limits& limits, VkDeviceSize bytes, VkFormat texel) {
  return texels_of(bytes, texel) <= limits.table_texels ? texel : VK_FORMAT_UNDEFINED;
}

Buffer::Buffer(Context& context, VkDeviceSize bytes, Memory memory, std::string_view purpose,
               VkFormat texel)
    : bytes_(bytes) {
  const VkDevice device = context.device();
  const auto doing = fmt::format("device '{}': {:.1f} MiB for {}", context.name(),
                                 static_cast<double>(bytes) / (1 << 20), purpose);
  if (bytes > context.limits().allocation) {
    throw Error(Fault::input,
                fmt::format("{}: more than the {:.1f} MiB it allocates at once; use fewer bins, "
                            "objects or cells",
                            doing, static_cast<double>(context.limits().allocation) / (1 << 20)));
  }
  // A driver on the host may promise more than there is.
  if (bytes > context.limits().memory ||
      context.memory_use().now > context.limits().memory - bytes) {
    throw Error(Fault::input,
                fmt::format("{}: more than is left of its {:.1f} MiB; use fewer bins, objects or "
                            "cells",
                            doing, static_cast<double>(context.limits().memory) / (1 << 20)));
  }
  // A larger view is undefined behaviour.
  if (table_where_it_fits(context.limits(), bytes, texel) != texel) {
    throw Error(Fault::input,
                fmt::format("{}: {} texels, more than the {} it reads as a table; use "
                            "fewer bins, objects or cells",
                            doing, texels_of(bytes, texel), context.limits().table_texels));
  }
  const VkBufferCreateInfo info{
      .sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
      .size = bytes,
      .usage = static_cast<VkBufferUsageFlags>(
          memory == Memory::device
              ? VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT |
                    VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT
          : memory == Memory::upload ? VK_BUFFER_USAGE_TRANSFER_SRC_BIT
                                     : VK_BUFFER_USAGE_TRANSFER_DST_BIT)};
  buffer_ = make_owned(vkCreateBuffer, vkDestroyBuffer, device, info, doing);
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device, buffer_.get(), &needs);
  constexpr VkMemoryPropertyFlags mapped =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const std::uint32_t type =
      memory == Memory::device
          ? context.memory_type(needs.memoryTypeBits, 0, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT)
      : memory == Memory::upload
          ? context.memory_type(needs.memoryTypeBits, mapped, 0)
          : context.memory_type(needs.memoryTypeBits, mapped, VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  const VkMemoryAllocateInfo allocation{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                        .allocationSize = needs.size,
                                        .memoryTypeIndex = type};
  memory_ = make_owned(vkAllocateMemory, vkFreeMemory, device, allocation, doing);
  context.take_memory(needs.size);
  counted_ = {&context, {needs.size}};
  check(vkBindBufferMemory(device, buffer_.get(), memory_.get(), 0), doing);
  if (texel != VK_FORMAT_UNDEFINED) {
    const VkBufferViewCreateInfo view{.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                      .buffer = buffer_.get(),
                                      .format = texel,
                                      .range = VK_WHOLE_SIZE};
    table_ = make_owned(vkCreateBufferView, vkDestroyBufferView, device, view, doing);
  }
  if (memory != Memory::device) {
    void* mapping = nullptr;
    check(vkMapMemory(device, memory_.get(), 0, VK_WHOLE_SIZE, 0, &mapping), doing);
    data_ = static_cast<std::byte*>(mapping);
  }
}

}  // namespace palpate::gpu
