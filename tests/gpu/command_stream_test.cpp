#include "gpu/command_stream.hpp"

#include <chrono>
#include <functional>
#include <string>

#include "scale_and_add_kernel.hpp"
#include "support/errors.hpp"

namespace palpate::gpu::command_stream_test {

using Words = std::vector<std::uint32_t>;

Buffer words_buffer(Context& context, std::size_t n) {
  return {context, n * sizeof(std::uint32_t), Memory::device, "a test"};
}

TEST(CommandStream, EveryCommandSeesTheOnesBefore) {
  Context context("");
  CommandStream stream(context);
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

TEST(CommandStream, ALongChainOfDispatchesTakesSeveralDescriptorPools) {
  Context context("");
  CommandStream stream(context);
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

TEST(CommandStream, StagingMemoryDoesNotGrowWithWhatIsCopiedAndTimeIsTheDevices) {
  Context context("");
  CommandStream stream(context);
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

TEST(CommandStream, AnyValidationMessageFailsTheRun) {
  Context context("");
  CommandStream stream(context);
  const Buffer a = words_buffer(context, 3);
  stream.fill(a, 1);
  vkResetFences(context.device(), 0, nullptr);  // invalid without a fence, but harmless
  // Without its layer, PALPATE_VALIDATION=1 is not set.
  expect_named(error_of(Fault::system, [&] { stream.run(); }), {"vkResetFences"});
}

/// Commands that a stream must refuse, with the words that the message must hold.
class Refusal : public testing::Test {
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

  Context context{""};
  CommandStream stream{context};
  ScaleAndAdd triple{context, 3};
  Buffer a = words_buffer(context, 8);
  Buffer b = words_buffer(context, 8);
  const ScaleAndAdd::Push push{8, 0};
};

TEST_F(Refusal, OfABindingAboveTheDevicesLimit) {
  Limits small = context.limits();
  small.storage_range = 1024;
  context.lower_limits(small);
  const Buffer large = words_buffer(context, 257);
  expect_refused([&] { triple.dispatch(stream, large, b, 1); }, "binding 0 of 1028 B");
}

TEST_F(Refusal, OfTooManyWorkgroups) {
  const auto& most = context.limits().group_count;
  for (const std::size_t dimension : {0U, 1U, 2U}) {
    std::array<std::uint32_t, 3> groups{1, 1, 1};
    groups[dimension] = most[dimension] + 1;
    if (groups[dimension] > 0) {  // else no number of workgroups exceeds this limit
      expect_refused(
          [&] {
            stream.dispatch(triple.kernel(), {&a, &b}, push, groups);
          },
          "workgroups");
    }
  }
}

TEST_F(Refusal, OfBuffersAndConstantsThatTheKernelDoesNotTake) {
  expect_refused(
      [&] {
        stream.dispatch(triple.kernel(), {&a}, push, {1, 1, 1});
      },
      "scale_and_add: 1 buffers");
  expect_refused(
      [&] {
        stream.dispatch(triple.kernel(), {&a, &b}, push.count, {1, 1, 1});
      },
      "4 B of constants");
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

}  // namespace palpate::gpu::command_stream_test
