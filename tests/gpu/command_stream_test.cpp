#include "gpu/command_stream.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <type_traits>
#include <utility>

#include "scale_and_add_kernel.hpp"
#include "support/errors.hpp"

namespace palpate::gpu::command_stream_test {

using Words = std::vector<std::uint32_t>;

Buffer words_buffer(Context& context, std::size_t n) {
  return {context, n * sizeof(std::uint32_t), Memory::device, "a test"};
}

class Commands : public testing::Test {
 protected:
  Context context{""};
  CommandStream stream{context};
};
using Transfers = Commands;

TEST_F(Commands, EveryCommandSeesTheOnesBefore) {
  const ScaleAndAdd triple(context, 3);
  const Words first = pattern<std::uint32_t>(1000);
  const Words second = pattern<std::uint32_t>(500);
  const Buffer a = words_buffer(context, 1000);
  const Buffer b = words_buffer(context, 1000);
  Words early(1000);
  Words late(1000);
  stream.upload(a, std::span(first));
  triple.dispatch(stream, a, b, 1);
  stream.download(b, std::span(early));
  stream.upload(a, std::span(second), 500 * sizeof(std::uint32_t));
  triple.dispatch(stream, a, b, 2);
  triple.dispatch(stream, b, a, 5);
  stream.download(a, std::span(late));
  stream.run();
  for (std::size_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(early[i], 3 * first[i] + 1) << i;
    const std::uint32_t source = i < 500 ? first[i] : second[i - 500];
    ASSERT_EQ(late[i], 3 * (3 * source + 2) + 5) << i;
  }
}

TEST_F(Commands, ALongChainOfDispatchesTakesSeveralDescriptorPools) {
  stream.run();  // nothing, which is allowed
  stream.run();
  const ScaleAndAdd copy(context, 1);
  const Buffer a = words_buffer(context, 65);
  const Buffer b = words_buffer(context, 65);
  for (const int repetition : {0, 1}) {
    stream.fill(a, 7);
    for (int i = 0; i < 100; ++i) {
      copy.dispatch(stream, a, b, 1);
      copy.dispatch(stream, b, a, 1);
    }
    Words words(65);
    stream.download(a, std::span(words));
    stream.run();
    EXPECT_EQ(words, Words(65, 207)) << "repetition " << repetition;
  }
}

TEST_F(Commands, StagingMemoryDoesNotGrowWithWhatIsCopiedAndTimeIsTheDevices) {
  const auto words = pattern<std::uint32_t>(2'000'001);
  {
    const Buffer a = words_buffer(context, words.size());
    const Buffer b = words_buffer(context, words.size());
    const VkDeviceSize buffers = context.memory_use().now;
    const ScaleAndAdd triple(context, 3);
    // One run takes all of the copies: 8 MB up and twice 8 MB down.
    Words tripled(words.size());
    Words plain(words.size());
    const auto start = std::chrono::steady_clock::now();
    stream.upload(a, std::span<const std::uint32_t>(words));
    triple.dispatch(stream, a, b, 1);
    stream.download(b, std::span(tripled));
    stream.download(a, std::span(plain));
    stream.run();
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    // Any device takes more than 1 us to write 2 million words; its clock may run a little faster
    // than the host's.
    EXPECT_GT(stream.device_seconds(), 1e-6);
    EXPECT_LT(stream.device_seconds(), 1.01 * wall.count());
    EXPECT_EQ(plain, words);
    for (std::size_t i = 0; i < words.size(); ++i) {
      ASSERT_EQ(tripled[i], 3 * words[i] + 1) << i;
    }
    EXPECT_LE(context.memory_use().peak, buffers + CommandStream::staging_bytes);
  }
  EXPECT_LE(context.memory_use().now, CommandStream::staging_bytes);
}

TEST_F(Commands, AnyValidationMessageFailsTheRun) {
  const Buffer a = words_buffer(context, 3);
  stream.fill(a, 1);
  vkResetFences(context.device(), 0, nullptr);  // invalid without a fence, but harmless
  // Without its layer, PALPATE_VALIDATION=1 is not set.
  expect_named(error_of(Fault::system, [&] { stream.run(); }), {"vkResetFences"});
}

/// Commands that a stream must refuse, with the words that the message must hold.
class Refusal : public Commands {
 protected:
  void expect_refused(const std::function<void()>& command, const char* says) {
    // The earlier recording is dropped, too: its buffer may be destroyed by the next run.
    Words never(8, 42);
    {
      const Buffer gone = words_buffer(context, 8);
      stream.fill(gone, 1);
      stream.download(gone, std::span(never));
      expect_named(error_of(Fault::system, command), {says});
    }
    stream.run();
    EXPECT_EQ(never, Words(8, 42));

    Words words(8);
    stream.fill(a, 10);
    triple.dispatch(stream, a, b, 1);
    stream.download(b, std::span(words));
    stream.run();
    EXPECT_EQ(words, Words(8, 31)) << "the stream is unusable afterwards";
  }

  ScaleAndAdd triple{context, 3};
  Buffer a = words_buffer(context, 8);
  Buffer b = words_buffer(context, 8);
  const ScaleAndAdd::Push push{8, 0};
};

TEST_F(Refusal, OfBindingsConstantsAndWorkgroupsThatTheKernelOrTheDeviceDoesNotTake) {
  const auto expect_dispatch_refused = [&](std::initializer_list<const Buffer*> buffers,
                                           const auto& constants,
                                           std::array<std::uint32_t, 3> groups, const char* says) {
    expect_refused([&] { stream.dispatch(triple.kernel(), buffers, constants, groups); }, says);
  };
  expect_dispatch_refused({&a}, push, {1, 1, 1}, "scale_and_add: 1 buffers");
  expect_dispatch_refused({&a, &b}, push.count, {1, 1, 1}, "4 B of constants");
  for (const std::size_t dimension : {0U, 1U, 2U}) {
    std::array<std::uint32_t, 3> groups{1, 1, 1};
    groups[dimension] = context.limits().group_count[dimension] + 1;
    if (groups[dimension] > 0) {  // else no number of workgroups exceeds this limit
      expect_dispatch_refused({&a, &b}, push, groups, "workgroups");
    }
  }
  Limits small = context.limits();
  small.storage_range = 1024;
  context.lower_limits(small);
  const Buffer large = words_buffer(context, 257);
  expect_dispatch_refused({&large, &b}, push, {1, 1, 1}, "binding 0 of 1028 B");
}

TEST_F(Refusal, OfATransferThatNoStagingMemoryHolds) {
  Limits small = context.limits();
  small.allocation = 1000;
  const Words words(251);
  const Buffer large = words_buffer(context, 251);
  context.lower_limits(small);
  CommandStream fresh(context);
  EXPECT_THROW(fresh.upload(large, std::span(words)), Error);
}

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

TEST_F(Transfers, BringBackWhatWasSent) {
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

TEST_F(Transfers, ReadTheValuesAtOnceAndOnlyThose) {
  const Buffer buffer(context, 8, Memory::device, "a test");
  stream.fill(buffer, 0x11111111);
  std::vector<std::uint8_t> values{1, 2, 3};
  stream.upload(buffer, std::span<const std::uint8_t>(values), 2);
  std::fill(values.begin(), values.end(), std::uint8_t{99});
  stream.upload(buffer, std::array<std::uint8_t, 1>{7}, 6);
  std::vector<std::uint8_t> some(3);
  std::vector<std::uint8_t> all(8);
  stream.download(buffer, std::span(some), 3);
  stream.download(buffer, std::span(all));
  stream.upload(buffer, std::span<const std::uint8_t>{});
  stream.run();
  EXPECT_EQ(some, (std::vector<std::uint8_t>{2, 3, 0x11}));
  EXPECT_EQ(all, (std::vector<std::uint8_t>{0x11, 0x11, 1, 2, 3, 0x11, 7, 0x11}));
}

}  // namespace palpate::gpu::command_stream_test
