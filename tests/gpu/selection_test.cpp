#include "gpu/selection.hpp"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate::gpu::selection_test {

// The ranks of the Vulkan device types.
enum Rank { discrete, integrated, virtual_gpu, cpu };

Candidate usable(int index, Rank rank, const std::string& name) {
  return {.physical = VK_NULL_HANDLE,
          .queue_family = 0,
          .rank = rank,
          .info = {.index = index, .name = name, .usable = true}};
}

Candidate unusable(int index, Rank rank, const std::string& name, const std::string& reason) {
  return {.physical = VK_NULL_HANDLE,
          .queue_family = 0,
          .rank = rank,
          .info = {.index = index, .name = name, .reason = reason}};
}

/// A machine with one device of each type; the best device is neither first nor last.
std::vector<Candidate> one_of_each() {
  return {usable(0, cpu, "llvmpipe (LLVM 15)"), usable(1, integrated, "Intel UHD 770"),
          usable(2, discrete, "NVIDIA RTX A2000"), usable(3, virtual_gpu, "Virtio GPU Venus")};
}

/// Index of the chosen device; -1 if none is chosen.
int choice(std::vector<Candidate>& candidates, std::string_view wish = {}) {
  choose(candidates, wish);
  int found = -1;
  for (const Candidate& candidate : candidates) {
    EXPECT_FALSE(candidate.info.reason.empty()) << candidate.info.name << " has no reason";
    if (candidate.info.chosen) {
      EXPECT_EQ(found, -1) << "two are chosen";
      found = candidate.info.index;
    }
  }
  return found;
}

TEST(Choose, PrefersDiscreteToIntegratedToVirtualToCpu) {
  std::vector<int> left{2, 1, 3, 0};
  std::vector<Candidate> candidates = one_of_each();
  std::mt19937 random(1);
  while (!left.empty()) {
    std::shuffle(candidates.begin(), candidates.end(), random);
    std::vector<Candidate> trial = candidates;
    EXPECT_EQ(choice(trial), left.front());
    std::erase_if(candidates, [&](const Candidate& c) { return c.info.index == left.front(); });
    left.erase(left.begin());
  }
}

TEST(Choose, SaysWhyEachOneIsOrIsNotTaken) {
  std::vector<Candidate> candidates = one_of_each();
  candidates.push_back(usable(4, discrete, "NVIDIA RTX A2000"));
  candidates.push_back(unusable(5, discrete, "Old GPU", "supports Vulkan 1.0.2, 1.1 is needed"));
  EXPECT_EQ(choice(candidates), 2) << "the first of two equals";
  EXPECT_EQ(candidates[2].info.reason, "the best usable device");
  EXPECT_NE(candidates[0].info.reason.find("ranks behind device 2"), std::string::npos);
  EXPECT_NE(candidates[4].info.reason.find("as good as device 2"), std::string::npos);
  EXPECT_EQ(candidates[5].info.reason, "supports Vulkan 1.0.2, 1.1 is needed");
}

TEST(Choose, TakesADeviceByIndex) {
  for (const int index : {0, 1, 2, 3}) {
    std::vector<Candidate> candidates = one_of_each();
    EXPECT_EQ(choice(candidates, std::to_string(index)), index);
  }
}

TEST(Choose, TakesADeviceByAPartOfItsNameInAnyCase) {
  const std::pair<const char*, int> wishes[] = {
      {"llvmpipe", 0}, {"LLVM", 0}, {"uhd 770", 1}, {"nvidia", 2}, {"venus", 3}};
  for (const auto& [wish, index] : wishes) {
    std::vector<Candidate> candidates = one_of_each();
    EXPECT_EQ(choice(candidates, wish), index) << wish;
    EXPECT_NE(candidates[index].info.reason.find(wish), std::string::npos);
  }
  std::vector<Candidate> candidates = one_of_each();
  EXPECT_EQ(choice(candidates, "i"), 2) << "the best of all that match";
}

TEST(Choose, ANumberIsAnIndexEvenWhereANameHasIt) {
  // Otherwise a wrong index would open a device whose name has the digit.
  std::vector<Candidate> candidates = one_of_each();
  EXPECT_EQ(choice(candidates, "15"), -1);
}

TEST(Choose, TakesNoneWhereNoneFits) {
  for (const char* wish : {"radeon", "4", "-1"}) {
    std::vector<Candidate> candidates = one_of_each();
    EXPECT_EQ(choice(candidates, wish), -1) << wish;
  }
}

TEST(Choose, NeverTakesAnUnusableDevice) {
  std::vector<Candidate> candidates{unusable(0, discrete, "Old GPU", "has no compute queue"),
                                    usable(1, cpu, "llvmpipe")};
  EXPECT_EQ(choice(candidates), 1);
  candidates[1].info.chosen = false;
  EXPECT_EQ(choice(candidates, "old"), -1);
}

std::string refusal(std::vector<Candidate> candidates, std::string_view wish, Fault fault) {
  choose(candidates, wish);
  try {
    chosen(candidates, wish);
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), fault);
    return error.what();
  }
  ADD_FAILURE() << "a device was chosen";
  return {};
}

TEST(Chosen, IsTheMarkedOne) {
  std::vector<Candidate> candidates = one_of_each();
  choose(candidates, {});
  EXPECT_EQ(chosen(candidates, {}).info.index, 2);
}

TEST(Chosen, NamesEveryDeviceWithItsReasonWhereNoneFits) {
  std::vector<Candidate> candidates = one_of_each();
  candidates.push_back(unusable(4, discrete, "Radeon HD", "has no compute queue"));
  const std::string message = refusal(candidates, "radeon", Fault::input);
  for (const Candidate& candidate : candidates) {
    EXPECT_NE(message.find(candidate.info.name), std::string::npos) << message;
  }
  EXPECT_NE(message.find("does not match 'radeon'"), std::string::npos) << message;
  EXPECT_NE(message.find("has no compute queue"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(Chosen, WithoutAWishTheMachineIsAtFault) {
  const std::string message =
      refusal({unusable(0, discrete, "Old GPU", "has no compute queue")}, {}, Fault::system);
  EXPECT_NE(message.find("Old GPU"), std::string::npos) << message;
  EXPECT_EQ(message.find("''"), std::string::npos) << "speaks of a wish: " << message;
  EXPECT_NE(refusal({}, {}, Fault::system).find("install libvulkan1"), std::string::npos);
  EXPECT_NE(refusal({}, "nvidia", Fault::system).find("install libvulkan1"), std::string::npos);
}

TEST(DeviceMemory, IsTheLargestHeapOfTheDevice) {
  VkPhysicalDeviceMemoryProperties memory{};
  memory.memoryHeapCount = 3;
  memory.memoryHeaps[0] = {.size = 64, .flags = 0};
  memory.memoryHeaps[1] = {.size = 8, .flags = VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
  memory.memoryHeaps[2] = {.size = 16, .flags = VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
  EXPECT_EQ(device_memory(memory), 16U);
}

TEST(Wished, IsTheEnvironmentsWhereNothingIsNamed) {
  const char* before = std::getenv("PALPATE_DEVICE");
  const std::string kept = before == nullptr ? "" : before;
  unsetenv("PALPATE_DEVICE");
  EXPECT_EQ(wished(""), "");
  EXPECT_EQ(wished("0"), "0");
  setenv("PALPATE_DEVICE", "llvmpipe", 1);
  EXPECT_EQ(wished(""), "llvmpipe");
  EXPECT_EQ(wished("0"), "0");
  before == nullptr ? unsetenv("PALPATE_DEVICE") : setenv("PALPATE_DEVICE", kept.c_str(), 1);
}

}  // namespace palpate::gpu::selection_test
