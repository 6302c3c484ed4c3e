#include "palpate/vulkan_device.hpp"

#include <atomic>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include "gpu/context.hpp"
#include "gpu/selection.hpp"
#include "letters.hpp"
#include "support/errors.hpp"

namespace palpate::vulkan_device_test {

/// A program's own Vulkan device, with the validation layer, whose messages end the test.
class Program {
 public:
  Program() {
    const std::vector<gpu::Candidate> all = gpu::candidates(instance_.handle(), gpu::wished({}));
    const gpu::Candidate& candidate = gpu::chosen(all, gpu::wished({}));
    const float priority = 1.0F;
    const VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                        .queueFamilyIndex = candidate.queue_family,
                                        .queueCount = 1,
                                        .pQueuePriorities = &priority};
    const VkDeviceCreateInfo info{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                                  .queueCreateInfoCount = 1,
                                  .pQueueCreateInfos = &queue};
    handles_ = {.instance = instance_.handle(),
                .physical_device = candidate.physical,
                .queue_family = candidate.queue_family,
                .queue_mutex = &mutex_};
    vkCreateDevice(candidate.physical, &info, nullptr, &handles_.device);
    vkGetDeviceQueue(handles_.device, candidate.queue_family, 0, &handles_.queue);
  }
  ~Program() { vkDestroyDevice(handles_.device, nullptr); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  const VulkanDevice& handles() const { return handles_; }
  VkResult submit_nothing() {
    const std::scoped_lock lock(mutex_);
    return vkQueueSubmit(handles_.queue, 0, nullptr, VK_NULL_HANDLE);
  }
  VkResult wait() {
    const std::scoped_lock lock(mutex_);
    return vkQueueWaitIdle(handles_.queue);
  }

 private:
  gpu::Instance instance_;
  std::mutex mutex_;
  VulkanDevice handles_;
};

std::vector<double> identity_on(Device& device, const std::vector<Hypothesis>& maps) {
  PoseHistogram belief(device, maps, {.lattice = small_lattice()});
  const Recording unknown = unknown_letter(4);
  belief.update(unknown.touches(0, unknown.size()));
  return belief.estimate().identity;
}

TEST(SharedDevice, GivesTheResultOfItsOwnAndTakesTurnsWithTheProgramOnItsQueue) {
  Device own = Device::open();
  const std::vector<Hypothesis> maps = letter_maps(own);
  const std::vector<double> expected = identity_on(own, maps);
  Program program;
  std::atomic<bool> done = false;
  int submissions = 0;
  std::jthread other([&] {  // the validation layer would report two threads in the queue
    do {
      EXPECT_EQ(program.submit_nothing(), VK_SUCCESS);
      ++submissions;
      std::this_thread::yield();  // lets Palpate have its turn
    } while (!done);
  });
  for (int i = 0; i < 2; ++i) {  // the program's device outlives Palpate's use of it
    Device shared = Device::share(program.handles());
    EXPECT_EQ(shared.name(), own.name());
    EXPECT_EQ(letter_maps(shared)[0].map.log_odds, maps[0].map.log_odds);
    EXPECT_EQ(identity_on(shared, maps), expected);
  }
  done = true;
  other.join();
  EXPECT_GT(submissions, 0);
  EXPECT_EQ(program.wait(), VK_SUCCESS);
}

TEST(SharedDevice, RefusesHandlesThatCannotCompute) {
  const Program program;
  VulkanDevice without_queue = program.handles();
  without_queue.queue = VK_NULL_HANDLE;
  expect_named(input_error([&] { Device::share(without_queue); }), {"a handle is null"});
  VulkanDevice without_family = program.handles();
  without_family.queue_family = std::numeric_limits<std::uint32_t>::max();
  expect_named(input_error([&] { Device::share(without_family); }), {"queue_family = 4294967295"});
}

}  // namespace palpate::vulkan_device_test
