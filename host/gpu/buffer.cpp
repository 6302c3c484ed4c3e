#include "buffer.hpp"

#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "result.hpp"

namespace palpate::gpu {

Buffer::Buffer(Context& context, VkDeviceSize bytes, Memory memory, std::string_view purpose,
               VkFormat texel)
    : context_(&context), bytes_(bytes) {
  const VkDevice device = context.device();
  const auto doing = fmt::format("device '{}': {:.1f} MiB for {}", context.name(),
                                 static_cast<double>(bytes) / (1 << 20), purpose);
  if (bytes > context.limits().allocation) {
    throw Error(Fault::input,
                fmt::format("{}: more than the {:.1f} MiB it allocates at once; use fewer bins, "
                            "objects or cells",
                            doing, static_cast<double>(context.limits().allocation) / (1 << 20)));
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
  check(vkCreateBuffer(device, &info, nullptr, &buffer_), doing);

  // A constructor that throws runs no destructor: `owner` frees what exists so far.
  Buffer owner;
  swap(owner);
  VkMemoryRequirements needs;
  vkGetBufferMemoryRequirements(device, owner.buffer_, &needs);
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
  check(vkAllocateMemory(device, &allocation, nullptr, &owner.memory_), doing);
  owner.allocated_ = needs.size;
  context.take_memory(needs.size);
  check(vkBindBufferMemory(device, owner.buffer_, owner.memory_, 0), doing);
  if (texel != VK_FORMAT_UNDEFINED) {
    const VkBufferViewCreateInfo view{.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                      .buffer = owner.buffer_,
                                      .format = texel,
                                      .range = VK_WHOLE_SIZE};
    check(vkCreateBufferView(device, &view, nullptr, &owner.table_), doing);
  }
  if (memory != Memory::device) {
    void* mapping = nullptr;
    check(vkMapMemory(device, owner.memory_, 0, VK_WHOLE_SIZE, 0, &mapping), doing);
    owner.data_ = static_cast<std::byte*>(mapping);
  }
  swap(owner);
}

Buffer::~Buffer() {
  if (context_ != nullptr) {
    const VkDevice device = context_->device();
    vkDestroyBufferView(device, table_, nullptr);
    vkDestroyBuffer(device, buffer_, nullptr);
    vkFreeMemory(device, memory_, nullptr);
    context_->give_memory(allocated_);
  }
}

void Buffer::swap(Buffer& other) noexcept {
  std::swap(context_, other.context_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(table_, other.table_);
  std::swap(bytes_, other.bytes_);
  std::swap(allocated_, other.allocated_);
  std::swap(data_, other.data_);
}

}  // namespace palpate::gpu
