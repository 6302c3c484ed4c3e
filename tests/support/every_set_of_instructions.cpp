// As the kernels.
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include "support/every_set_of_instructions.hpp"

#include <bit>
#include <cstdint>

#include <gtest/gtest.h>
#include <hwy/highway.h>

namespace palpate {

namespace {

/// Ends with the processor's own instructions.
class ChosenInstructions {
 public:
  explicit ChosenInstructions(std::int64_t target) { choose(target); }
  ~ChosenInstructions() { choose(0); }
  ChosenInstructions(const ChosenInstructions&) = delete;
  ChosenInstructions& operator=(const ChosenInstructions&) = delete;

 private:
  static void choose(std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

}  // namespace

void with_every_set_of_instructions(const std::function<void(const std::string&)>& test) {
  // Better sets have lower bits.
  std::uint64_t left = static_cast<std::uint64_t>(hwy::SupportedTargets() & HWY_TARGETS);
  EXPECT_GE(std::popcount(left), 2) << "without a second set there is nothing to compare";
  while (left != 0) {
    const std::uint64_t target = std::bit_floor(left);
    left ^= target;
    const ChosenInstructions chosen(static_cast<std::int64_t>(target));
    test(hwy::TargetName(static_cast<std::int64_t>(target)));
  }
}

}  // namespace palpate
