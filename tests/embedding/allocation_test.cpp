// update() allocates no memory after the first one of a size: a control loop must not wait for the
// allocator. What the Vulkan driver takes by malloc() is not counted.
#include <cstdlib>
#include <new>
#include <optional>

#include "letters.hpp"
#include "support/variable.hpp"

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

class Updates : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    // Without Vulkan's validation layer, which allocates at every call
    const Variable validation("PALPATE_VALIDATION", "0");
    device_.emplace(Device::open());
    maps_ = letter_maps(*device_);
    unknown_ = unknown_letter(12);
  }
  static void TearDownTestSuite() { device_.reset(); }

  /// The first update may allocate; it shows that the count works.
  template <typename Filter>
  static void expect_none_after_the_first(Filter&& filter) {
    EXPECT_GT(allocations_of([&] { filter.update(unknown_.touch(0)); }), 0U);
    for (std::size_t i = 1; i < unknown_.size(); ++i) {
      const Touch touch = unknown_.touch(i);
      EXPECT_EQ(allocations_of([&] { filter.update(touch); }), 0U) << "touch " << i;
    }
    // Nor does what comes between updates make the next one allocate.
    filter.estimate();
    EXPECT_EQ(allocations_of([&] { filter.update(unknown_.touch(1)); }), 0U);
    filter.reset();
    EXPECT_EQ(allocations_of([&] { filter.update(unknown_.touch(2)); }), 0U) << "after a reset";
  }

  inline static std::optional<Device> device_;
  inline static std::vector<Hypothesis> maps_;
  inline static Recording unknown_;
};

TEST_F(Updates, OfAHistogramAllocateNothingAfterTheFirst) {
  const DisplacementSd sd{.mm = 1.0, .rad = 0.1};
  const LikelihoodTable table{.nodes = 2,
                              .level_edges = {10.0, 20.0},
                              .log_likelihood = {-0.1, -3.0, -2.0, -1.5, -2.5, -1.2, -3.0, -0.9}};
  const std::pair<const char*, HistogramOptions> cases[] = {
      {"plain", {}},
      {"by a table", {.contact = {.table = table}}},
      {"uncertain touches", {.touch_sd = sd}},
      {"slip", {.slip_sd = sd}},
      {"none", {.none_weight = 1.0}},
      {"all", {.none_weight = 1.0, .touch_sd = sd, .slip_sd = sd}}};
  for (const auto& [name, options] : cases) {
    SCOPED_TRACE(name);
    HistogramOptions small = options;
    small.lattice = small_lattice();
    expect_none_after_the_first(PoseHistogram(*device_, maps_, small));
  }
}

TEST_F(Updates, OfSeveralTouchesAllocateNothingAfterTheFirst) {
  PoseHistogram filter(*device_, maps_, {.lattice = small_lattice()});
  const std::vector<Touch> second = unknown_.touches(6, 12);
  filter.update(unknown_.touches(0, 6));
  EXPECT_EQ(allocations_of([&] { filter.update(second); }), 0U);
}

TEST_F(Updates, OfParticlesAndOfASearchByBoundsAllocateNothingAfterTheFirst) {
  for (const Resampling resampling : {Resampling::multinomial, Resampling::systematic}) {
    for (const bool augmented : {false, true}) {
      expect_none_after_the_first(ParticleFilter(
          *device_, maps_, {.particles = 2000, .resampling = resampling, .augmented = augmented}));
    }
  }
  for (const std::optional<double> none_weight : {std::optional<double>(), std::optional(1.0)}) {
    expect_none_after_the_first(
        BoundedPosterior(maps_, {.lattice = small_lattice(), .none_weight = none_weight}));
  }
}

}  // namespace
}  // namespace palpate
