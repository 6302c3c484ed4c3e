#include "gpu/owned.hpp"

#include "gpu/vulkan.hpp"

namespace palpate::gpu {

void destroy(VkDevice device, VkBuffer object) { vkDestroyBuffer(device, object, nullptr); }
void destroy(VkDevice device, VkBufferView object) { vkDestroyBufferView(device, object, nullptr); }
void destroy(VkDevice device, VkCommandPool object) {
  vkDestroyCommandPool(device, object, nullptr);
}
void destroy(VkDevice device, VkDescriptorPool object) {
  vkDestroyDescriptorPool(device, object, nullptr);
}
void destroy(VkDevice device, VkDescriptorSetLayout object) {
  vkDestroyDescriptorSetLayout(device, object, nullptr);
}
void destroy(VkDevice device, VkDeviceMemory object) { vkFreeMemory(device, object, nullptr); }
void destroy(VkDevice device, VkFence object) { vkDestroyFence(device, object, nullptr); }
void destroy(VkDevice device, VkPipeline object) { vkDestroyPipeline(device, object, nullptr); }
void destroy(VkDevice device, VkPipelineLayout object) {
  vkDestroyPipelineLayout(device, object, nullptr);
}
void destroy(VkDevice device, VkQueryPool object) { vkDestroyQueryPool(device, object, nullptr); }
void destroy(VkDevice device, VkShaderModule object) {
  vkDestroyShaderModule(device, object, nullptr);
}

}  // namespace palpate::gpu
