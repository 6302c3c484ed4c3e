#include "gpu/kernel.hpp"

#include <iterator>
#include <vector>

#include "scale_and_add_kernel.hpp"
#include "support/errors.hpp"

namespace palpate::gpu::kernel_test {

/// The kernel's factor * i + addend for i = 0, 1, ..., n - 1, from the device.
std::vector<std::uint32_t> scaled_count(Context& context, const ScaleAndAdd& kernel, std::size_t n,
                                        std::uint32_t addend) {
  CommandStream stream(context);
  std::vector<std::uint32_t> words(n);
  for (std::size_t i = 0; i < n; ++i) {
    words[i] = static_cast<std::uint32_t>(i);
  }
  const Buffer source(context, n * 4, Memory::device, "a test");
  const Buffer target(context, n * 4, Memory::device, "a test");
  stream.upload(source, std::span<const std::uint32_t>(words));
  stream.fill(target, 0);
  kernel.dispatch(stream, source, target, addend);
  stream.download(target, std::span(words));
  stream.run();
  return words;
}

TEST(Kernel, TakesSpecializationAndPushConstantsAtEverySize) {
  Context context("");
  // A workgroup has 32 invocations: sizes around one, two and many workgroups. All 32 bits arrive.
  for (const std::uint32_t factor : {1U, 5U, 0xFFFFFFFFU}) {
    const ScaleAndAdd kernel(context, factor);
    for (const std::size_t n : {1U, 7U, 31U, 32U, 63U, 65U, 1000U}) {
      const std::vector<std::uint32_t> words = scaled_count(context, kernel, n, 11);
      for (std::uint32_t i = 0; i < n; ++i) {
        ASSERT_EQ(words[i], factor * i + 11) << "element " << i << " of " << n;
      }
    }
  }
}

TEST(Kernel, SharesThePipelineOfItsLikeAlone) {
  static const std::vector<std::uint32_t> copy(std::begin(shaders::scale_and_add),
                                               std::end(shaders::scale_and_add));
  const KernelInfo info{.name = "scale_and_add",
                        .spirv = shaders::scale_and_add,
                        .bindings = {Access::storage, Access::storage},
                        .push_bytes = sizeof(ScaleAndAdd::Push),
                        .constants = {ScaleAndAdd::workgroup, 2}};
  KernelInfo other_code = info;
  other_code.spirv = copy;
  KernelInfo more_buffers = info;
  more_buffers.bindings.push_back(Access::storage);
  KernelInfo more_to_push = info;
  more_to_push.push_bytes += 4;
  KernelInfo other_factor = info;
  other_factor.constants.back() = 3;
  Context context("");
  Context other_device("");
  const Kernel kernel(context, info);
  for (const KernelInfo& unlike : {other_code, more_buffers, more_to_push, other_factor}) {
    EXPECT_NE(Kernel(context, unlike).pipeline(), kernel.pipeline());
  }
  EXPECT_NE(Kernel(other_device, info).pipeline(), kernel.pipeline());
  EXPECT_EQ(Kernel(context, info).pipeline(), kernel.pipeline());
}

TEST(Kernel, WorksAfterMoreOthersThanAreKept) {
  Context context("");
  const ScaleAndAdd kernel(context, 5);
  const ScaleAndAdd used(context, 4);
  for (std::uint32_t factor = 6; factor < 76; ++factor) {
    const ScaleAndAdd other(context, factor);
    const ScaleAndAdd used_again(context, 4);
    ASSERT_EQ(used_again.kernel().pipeline(), used.kernel().pipeline()) << "the last used is kept";
  }
  const ScaleAndAdd again(context, 5);
  EXPECT_NE(again.kernel().pipeline(), kernel.kernel().pipeline()) << "it is no longer kept";
  EXPECT_EQ(scaled_count(context, kernel, 3, 7), (std::vector<std::uint32_t>{7, 12, 17}));
  EXPECT_EQ(scaled_count(context, again, 3, 7), (std::vector<std::uint32_t>{7, 12, 17}));
}

TEST(Kernel, NeedingMoreThanTheDeviceHasIsRefusedByName) {
  Context context("");
  const auto expect_refused = [&](std::size_t buffers, std::uint32_t push_bytes) {
    const std::vector<Access> bindings(buffers, Access::storage);
    expect_named(error_of(Fault::system,
                          [&] {
                            Kernel(context, {.name = "greedy",
                                             .spirv = shaders::scale_and_add,
                                             .bindings = bindings,
                                             .push_bytes = push_bytes});
                          }),
                 {"greedy"});
  };
  expect_refused(2, context.limits().push_bytes + 4);
  expect_refused(1000, 8);
}

}  // namespace palpate::gpu::kernel_test
