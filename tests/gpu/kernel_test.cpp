#include "gpu/kernel.hpp"

#include <type_traits>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "scale_and_add_kernel.hpp"

namespace palpate::gpu::kernel_test {

static_assert(!std::is_copy_constructible_v<Kernel> && !std::is_copy_assignable_v<Kernel>);

/// factor * i + addend for i = 0, 1, ..., n - 1, from the device.
std::vector<std::uint32_t> scaled_count(std::size_t n, std::uint32_t factor, std::uint32_t addend) {
  Context context("");
  CommandStream stream(context);
  std::vector<std::uint32_t> words(n);
  for (std::size_t i = 0; i < n; ++i) {
    words[i] = static_cast<std::uint32_t>(i);
  }
  const Buffer source(context, n * 4, Memory::device, "a test");
  const Buffer target(context, n * 4, Memory::device, "a test");
  stream.upload(source, std::span<const std::uint32_t>(words));
  stream.fill(target, 0);
  const ScaleAndAdd kernel(context, factor);
  kernel.dispatch(stream, source, target, addend);
  stream.download(target, std::span(words));
  stream.run();
  return words;
}

TEST(Kernel, TakesSpecializationAndPushConstantsAtEverySize) {
  // A workgroup has 32 invocations: sizes around one, two and many workgroups.
  for (const std::size_t n : {1U, 7U, 31U, 32U, 63U, 65U, 1000U}) {
    const std::vector<std::uint32_t> words = scaled_count(n, 5, 11);
    for (std::size_t i = 0; i < n; ++i) {
      ASSERT_EQ(words[i], 5 * i + 11) << "element " << i << " of " << n;
    }
  }
}

TEST(Kernel, EachHasItsOwnConstants) {
  EXPECT_EQ(scaled_count(3, 1, 0), (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(scaled_count(3, 0xFFFFFFFF, 0), (std::vector<std::uint32_t>{0, 0xFFFFFFFF, 0xFFFFFFFE}))
      << "all 32 bits arrive";
}

TEST(Kernel, NeedingMoreThanTheDeviceHasIsRefusedByName) {
  Context context("");
  const auto expect_refused = [&](std::size_t buffers, std::uint32_t push_bytes) {
    const std::vector<Access> bindings(buffers, Access::storage);
    try {
      const Kernel kernel(context, {.name = "greedy",
                                    .spirv = shaders::scale_and_add,
                                    .bindings = bindings,
                                    .push_bytes = push_bytes});
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::system);
      EXPECT_NE(std::string(error.what()).find("greedy"), std::string::npos) << error.what();
    }
  };
  expect_refused(2, context.limits().push_bytes + 4);
  expect_refused(1000, 8);
}

}  // namespace palpate::gpu::kernel_test
