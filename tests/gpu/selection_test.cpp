#include "gpu/selection.hpp"

#include <algorithm>
#include <random>

#include "support/errors.hpp"
#include "support/variable.hpp"

namespace palpate::gpu::selection_test {

// The ranks of the Vulkan device types.
enum Rank { discrete, integrated, virtual_gpu, cpu };

Candidate usable(int index, Rank rank, const std::string& name) {
  return {.rank = rank, .info = {.index = index, .name = name, .usable = true}};
}

Candidate unusable(int index, Rank rank, const std::string& name, const std::string& reason) {
  return {.rank = rank, .info = {.index = index, .name = name, .reason = reason}};
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

TEST(Choose, TakesADeviceByIndexOrByAPartOfItsNameInAnyCase) {
  // A number is an index even where a name has it: otherwise a wrong index would open a device
  // whose name has the digit. Of all that match, the best is taken.
  const std::pair<std::string, int> wishes[] = {
      {"0", 0},    {"1", 1},       {"2", 2},       {"3", 3},    {"15", -1},
      {"4", -1},   {"-1", -1},     {"radeon", -1}, {"i", 2},    {"llvmpipe", 0},
      {"LLVM", 0}, {"uhd 770", 1}, {"nvidia", 2},  {"venus", 3}};
  for (const auto& [wish, index] : wishes) {
    SCOPED_TRACE(wish);
    std::vector<Candidate> candidates = one_of_each();
    EXPECT_EQ(choice(candidates, wish), index);
    if (index >= 0 && wish.size() > 1) {
      expect_named(candidates[static_cast<std::size_t>(index)].info.reason, {wish.c_str()});
    }
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
  return error_of(fault, [&] { chosen(candidates, wish); });
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
    expect_named(message, {candidate.info.name.c_str()});
  }
  expect_named(message, {"does not match 'radeon'", "has no compute queue"});
}

TEST(Chosen, WithoutAWishTheMachineIsAtFault) {
  const std::string message =
      refusal({unusable(0, discrete, "Old GPU", "has no compute queue")}, {}, Fault::system);
  expect_named(message, {"Old GPU"});
  EXPECT_EQ(message.find("''"), std::string::npos) << "speaks of a wish: " << message;
  for (const char* wish : {"", "nvidia"}) {
    expect_named(refusal({}, wish, Fault::system), {"install libvulkan1"});
  }
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
  for (const std::optional<std::string>& named : {std::optional<std::string>(), {"llvmpipe"}}) {
    const Variable device("PALPATE_DEVICE", named);
    EXPECT_EQ(wished(""), named.value_or(""));
    EXPECT_EQ(wished("0"), "0");
  }
}

}  // namespace palpate::gpu::selection_test
