// update() allocates no memory after the first one of a size: a control loop must not wait for the
// allocator. What the Vulkan driver takes by malloc() is not counted.
#include <algorithm>
#include <cstdlib>
#include <new>
#include <optional>

#include <gtest/gtest.h>

#include "letters.hpp"

namespace {

/// How often operator new is called on this thread while `counting`.
thread_local std::size_t allocations = 0;
thread_local bool counting = false;

void* allocate(std::size_t bytes, std::size_t alignment) {
  allocations += counting ? 1 : 0;
  void* const memory =
      std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}

}  // namespace

void* operator new(std::size_t bytes) {
  return allocate(bytes == 0 ? 1 : bytes, __STDCPP_DEFAULT_NEW_ALIGNMENT__);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return allocate(bytes == 0 ? 1 : bytes, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace palpate {
namespace {

template <typename Call>
std::size_t allocations_of(const Call& call) {
  allocations = 0;
  counting = true;
  call();
  counting = false;
  return allocations;
}

/// An open device without Vulkan's validation layer, which allocates at every call.
Device open_quietly() {
  setenv("PALPATE_VALIDATION", "0", 1);
  return Device::open();
}

class Updates : public testing::Test {
 protected:
  Device device_ = open_quietly();
  std::vector<Hypothesis> maps_ = letter_maps(device_);
  Recording unknown_ = unknown_letter(12);

  /// The first update may allocate; it shows that the count works.
  template <typename Filter>
  void expect_none_after_the_first(Filter& filter) {
    EXPECT_GT(allocations_of([&] { filter.update(unknown_.touch(0)); }), 0U);
    for (std::size_t i = 1; i < unknown_.size(); ++i) {
      const Touch touch = unknown_.touch(i);
      EXPECT_EQ(allocations_of([&] { filter.update(touch); }), 0U) << "touch " << i;
    }
    // Nor does what comes between updates make the next one allocate.
    filter.estimate();
    EXPECT_EQ(allocations_of([&] { filter.update(unknown_.touch(1)); }), 0U);
  }
};

TEST_F(Updates, OfAHistogramAllocateNothingAfterTheFirst) {
  PoseHistogram filter(device_, maps_, {.lattice = small_lattice()});
  expect_none_after_the_first(filter);
  filter.reset();
  EXPECT_EQ(allocations_of([&] { filter.update(unknown_.touch(2)); }), 0U) << "after a reset";
}

TEST_F(Updates, OfSeveralTouchesAllocateNothingAfterTheFirst) {
  PoseHistogram filter(device_, maps_, {.lattice = small_lattice()});
  const std::vector<Touch> first = unknown_.touches(0, 6);
  const std::vector<Touch> second = unknown_.touches(6, 12);
  filter.update(first);
  EXPECT_EQ(allocations_of([&] { filter.update(second); }), 0U);
}

TEST_F(Updates, OfUncertainTouchesSlipAndNoneAllocateNothingAfterTheFirst) {
  const DisplacementSd sd{.mm = 1.0, .rad = 0.1};
  const HistogramOptions each{.lattice = small_lattice()};
  HistogramOptions uncertain = each;
  uncertain.touch_sd = sd;
  HistogramOptions slipping = each;
  slipping.slip_sd = sd;
  HistogramOptions none = each;
  none.none_weight = 1.0;
  HistogramOptions all = uncertain;
  all.slip_sd = sd;
  all.none_weight = 1.0;
  for (const HistogramOptions& options : {uncertain, slipping, none, all}) {
    PoseHistogram filter(device_, maps_, options);
    expect_none_after_the_first(filter);
    filter.reset();
    EXPECT_EQ(allocations_of([&] { filter.update(unknown_.touch(2)); }), 0U) << "after a reset";
  }
}

TEST_F(Updates, ByATableAllocateNothingAfterTheFirst) {
  const LikelihoodTable table{.nodes = 2,
                              .level_edges = {10.0, 20.0},
                              .log_likelihood = {-0.1, -3.0, -2.0, -1.5, -2.5, -1.2, -3.0, -0.9}};
  PoseHistogram filter(device_, maps_, {.lattice = small_lattice(), .contact = {.table = table}});
  expect_none_after_the_first(filter);
}

TEST_F(Updates, OfAParticleFilterAllocateNothingAfterTheFirst) {
  for (const Resampling resampling : {Resampling::multinomial, Resampling::systematic}) {
    for (const bool augmented : {false, true}) {
      ParticleFilter filter(device_, maps_,
                            {.particles = 2000, .resampling = resampling, .augmented = augmented});
      expect_none_after_the_first(filter);
    }
  }
}

TEST_F(Updates, OfASearchByBoundsAllocateNothingAfterTheFirst) {
  for (const std::optional<double> none_weight : {std::optional<double>(), std::optional(1.0)}) {
    BoundedPosterior filter(maps_, {.lattice = small_lattice(), .none_weight = none_weight});
    expect_none_after_the_first(filter);
    filter.reset();
    EXPECT_EQ(allocations_of([&] { filter.update(unknown_.touch(2)); }), 0U) << "after a reset";
  }
}

}  // namespace
}  // namespace palpate
