#include "gpu/buffer.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "gpu/command_stream.hpp"
#include "scale_and_add_kernel.hpp"
#include "support/errors.hpp"

namespace palpate::gpu::buffer_test {

static_assert(!std::is_copy_constructible_v<Buffer> && !std::is_copy_assignable_v<Buffer>);

TEST(Buffer, MovesWithItsMemoryWhichIsMappedIfItStages) {
  Context context("");
  EXPECT_EQ(Buffer(context, 16, Memory::device, "a test").data(), nullptr);
  EXPECT_NE(Buffer(context, 16, Memory::download, "a test").data(), nullptr);
  Buffer first(context, 100, Memory::upload, "a test");
  std::byte* const data = first.data();
  EXPECT_NE(data, nullptr);
  Buffer second(std::move(first));
  EXPECT_EQ(second.data(), data);
  EXPECT_EQ(second.bytes(), 100U);
  Buffer third;
  third = std::move(second);
  EXPECT_EQ(third.data(), data);
  // The validation layer reports leaked and twice freed objects at the end.
}

TEST(Buffer, TooLargeAnAllocationSaysForWhatAndLeavesTheDeviceUsable) {
  Context context("");
  EXPECT_THROW(Buffer(context, context.limits().allocation + 1, Memory::device, "a test"), Error);
  Limits small = context.limits();
  small.allocation = 1 << 20;
  context.lower_limits(small);
  expect_named(input_error([&] { Buffer(context, (1 << 20) + 1, Memory::device, "a test"); }),
               {"1.0 MiB for a test", context.name().c_str()});
  EXPECT_EQ(Buffer(context, 1 << 20, Memory::device, "a test").bytes(), 1U << 20);
}

TEST(Buffer, AsALargerTableThanTheDeviceReadsIsRefusedBeforeItTakesMemory) {
  Context context("");
  Limits small = context.limits();
  small.table_texels = 1000;
  context.lower_limits(small);
  for (const auto& [format, bytes] :
       {std::pair(VK_FORMAT_R32_SFLOAT, 4U), std::pair(VK_FORMAT_R32G32_SFLOAT, 8U),
        std::pair(VK_FORMAT_R32G32B32A32_SFLOAT, 16U)}) {
    EXPECT_NE(Buffer(context, 1000 * bytes, Memory::device, "a test", format).table(), nullptr);
    const VkDeviceSize before = context.memory_use().peak;
    expect_named(
        input_error([&] { Buffer(context, 1001 * bytes, Memory::device, "a test", format); }),
        {"for a test: 1001 texels, more than the 1000"});
    EXPECT_EQ(context.memory_use().peak, before);
  }
}

TEST(Context, LimitsAreLoweredNeverRaised) {
  Context context("");
  const Limits own = context.limits();
  Limits other = own;
  other.table_texels = ~0U;
  other.storage_range = 1024;
  context.lower_limits(other);
  EXPECT_EQ(context.limits().table_texels, own.table_texels);
  EXPECT_EQ(context.limits().storage_range, 1024U);
  context.lower_limits(own);
  EXPECT_EQ(context.limits().storage_range, own.storage_range);
}

TEST(Transfers, BringBackWhatWasSent) {
  Context context("");
  CommandStream stream(context);
  constexpr std::size_t block = 4 << 20;  // of staging memory
  for (const std::size_t size : {std::size_t{1}, std::size_t{2}, std::size_t{3}, std::size_t{63},
                                 block - 1, block, block + 1, 2 * block + 3}) {
    const std::vector<std::uint8_t> sent = pattern<std::uint8_t>(size);
    const Buffer buffer(context, size, Memory::device, "a test");
    stream.upload(buffer, std::span(sent));
    std::vector<std::uint8_t> received(size);
    stream.download(buffer, std::span(received));
    stream.run();
    EXPECT_TRUE(sent == received) << size;
  }
}

TEST(Transfers, ManyOfThemTakeSeveralStagingBlocks) {
  Context context("");
  CommandStream stream(context);
  constexpr std::size_t pieces = 41;
  constexpr std::size_t piece = 300001;  // odd, and 41 of them fill three blocks
  const std::vector<std::uint8_t> sent = pattern<std::uint8_t>(pieces * piece);
  const Buffer buffer(context, sent.size(), Memory::device, "a test");
  for (const int repetition : {0, 1}) {
    std::vector<std::uint8_t> received(sent.size());
    for (std::size_t i = 0; i < pieces; ++i) {
      stream.upload(buffer, std::span(sent).subspan(i * piece, piece), i * piece);
    }
    for (std::size_t i = 0; i < pieces; ++i) {
      stream.download(buffer, std::span(received).subspan(i * piece, piece), i * piece);
    }
    stream.run();
    EXPECT_TRUE(sent == received) << "repetition " << repetition;
  }
}

TEST(Transfers, ReadTheValuesAtOnceAndOnlyThose) {
  Context context("");
  CommandStream stream(context);
  const Buffer buffer(context, 8, Memory::device, "a test");
  stream.fill(buffer, 0x11111111);
  std::vector<std::uint8_t> values{1, 2, 3};
  stream.upload(buffer, std::span<const std::uint8_t>(values), 2);
  std::fill(values.begin(), values.end(), std::uint8_t{99});
  std::vector<std::uint8_t> all(8);
  stream.download(buffer, std::span(all));
  stream.upload(buffer, std::span<const std::uint8_t>{});
  stream.run();
  EXPECT_EQ(all, (std::vector<std::uint8_t>{0x11, 0x11, 1, 2, 3, 0x11, 0x11, 0x11}));
}

}  // namespace palpate::gpu::buffer_test
