#include "gpu/run_queue.hpp"

#include <cstring>
#include <limits>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/recording.hpp"
#include "gpu/submitter.hpp"
#include "scale_and_add_kernel.hpp"

namespace palpate::gpu::run_queue_test {

using Words = std::vector<std::uint32_t>;

Buffer words_buffer(Context& context, std::size_t n) {
  return {context, n * sizeof(std::uint32_t), Memory::device, "a test"};
}

/// A recording with one dispatch, which is never run.
Recording with_work(double work) {
  Recording recording;
  recording.dispatch(Kernel(), VK_NULL_HANDLE, {}, {1, 1, 1}, work);
  return recording;
}

/// Takes the front of a line and what goes with it, as numbers of `runs`.
std::vector<std::size_t> taken(WaitingLine& line, const std::vector<WaitingRun>& runs) {
  std::vector<std::size_t> numbers;
  for (const WaitingRun* run = line.take(); run != nullptr; run = run->next) {
    numbers.push_back(static_cast<std::size_t>(run - runs.data()));
  }
  return numbers;
}

TEST(WaitingLine, LittleWorkGoesTogetherAndMuchAlone) {
  using Numbers = std::vector<std::size_t>;
  const Recording little = with_work(2e8);
  const Recording much = with_work(4e8);
  const Recording unknown = with_work(std::numeric_limits<double>::infinity());
  std::vector<WaitingRun> runs;
  for (const Recording* recording :
       {&little, &much, &little, &little, &unknown, &unknown, &little}) {
    runs.push_back({.recording = recording});
  }
  WaitingLine line;
  EXPECT_EQ(line.front(), nullptr);
  for (std::size_t i : {0U, 1U, 2U, 3U, 4U, 5U}) {
    line.add(runs[i]);
  }
  EXPECT_EQ(taken(line, runs), (Numbers{0, 2}));  // three are above 5e8
  EXPECT_EQ(line.front(), &runs[1]);
  line.add(runs[6]);
  EXPECT_EQ(taken(line, runs), Numbers{1});
  EXPECT_EQ(taken(line, runs), (Numbers{3, 6}));
  EXPECT_EQ(taken(line, runs), Numbers{4});
  EXPECT_EQ(taken(line, runs), Numbers{5});
  EXPECT_EQ(line.front(), nullptr);
}

TEST(WaitingLine, RecordingsWithoutDispatchesAreLittleWork) {
  const Recording copies;
  std::vector<WaitingRun> runs(2, {.recording = &copies});
  WaitingLine line;
  line.add(runs[0]);
  line.add(runs[1]);
  EXPECT_EQ(taken(line, runs), (std::vector<std::size_t>{0, 1}));
}

TEST(WaitingLine, NoMoreGoTogetherThanASubmissionTakes) {
  const Recording little = with_work(1.0);
  std::vector<WaitingRun> runs(20, {.recording = &little});
  WaitingLine line;
  for (WaitingRun& run : runs) {
    line.add(run);
  }
  EXPECT_EQ(taken(line, runs).size(), 16U);
  EXPECT_EQ(line.front(), &runs[16]);
  EXPECT_EQ(taken(line, runs), (std::vector<std::size_t>{16, 17, 18, 19}));
}

TEST(Submitter, EachOfSeveralRecordingsSeesItsOwnCommandsInOrder) {
  Context context("");
  Submitter submitter(context);
  constexpr std::size_t chains = 3;
  constexpr VkBufferCopy all{0, 0, 65 * sizeof(std::uint32_t)};
  std::vector<Buffer> buffers;
  std::vector<Recording> recordings(chains);
  std::vector<WaitingRun> runs(chains);
  for (std::uint32_t chain = 0; chain < chains; ++chain) {
    // A chain of copies, each longer than the one before.
    buffers.push_back(words_buffer(context, 65));
    recordings[chain].fill(buffers.back().handle(), 100 + chain);
    for (std::uint32_t link = 0; link < 1 + 4 * chain; ++link) {
      buffers.push_back(words_buffer(context, 65));
      recordings[chain].copy(buffers[buffers.size() - 2].handle(), buffers.back().handle(), all);
    }
    buffers.push_back(
        Buffer(context, 65 * sizeof(std::uint32_t), Memory::download, "a test's result"));
    recordings[chain].copy(buffers[buffers.size() - 2].handle(), buffers.back().handle(), all);
    runs[chain].recording = &recordings[chain];
    if (chain > 0) {
      runs[chain - 1].next = &runs[chain];
    }
  }
  for (const int repetition : {0, 1}) {
    const RunOutcome outcome = submitter.run(runs.front());
    ASSERT_EQ(outcome.result, VK_SUCCESS) << repetition;
    EXPECT_GT(outcome.seconds, 0.0);
    context.validation().throw_if_any();
    std::uint32_t chain = 0;
    for (const Buffer& buffer : buffers) {
      if (buffer.data() != nullptr) {
        Words words(65);
        std::memcpy(words.data(), buffer.data(), buffer.bytes());
        EXPECT_EQ(words, Words(65, 100 + chain)) << repetition << ", " << chain;
        std::memset(buffer.data(), 0, buffer.bytes());
        ++chain;
      }
    }
    EXPECT_EQ(chain, chains);
  }
}

/// Runs of streams of several threads on one device, of few commands and many, small and large.
TEST(RunQueue, EveryThreadGetsItsOwnResults) {
  Context context("");
  constexpr std::uint32_t threads = 6;
  constexpr std::uint32_t repetitions = 20;
  std::vector<std::uint32_t> wrong(threads, repetitions);
  {
    std::vector<std::jthread> running;
    for (std::uint32_t thread = 0; thread < threads; ++thread) {
      running.emplace_back([&context, thread, &wrong = wrong[thread]] {
        CommandStream stream(context);
        const ScaleAndAdd triple(context, 3);
        // The last two are much work, which is submitted alone.
        const std::size_t n = thread < threads - 2 ? 65 : 30'000;
        const double work = thread < threads - 2 ? 65.0 : 1e9;
        const Buffer a = words_buffer(context, n);
        const Buffer b = words_buffer(context, n);
        for (std::uint32_t repetition = 0; repetition < repetitions; ++repetition) {
          std::uint32_t value = 1000 * thread + repetition;
          Words words(n);
          stream.fill(a, value);
          for (std::uint32_t i = 0; i <= 2 * thread; ++i) {
            triple.dispatch(stream, a, b, i, work);
            triple.dispatch(stream, b, a, thread, work);
            value = 3 * (3 * value + i) + thread;
          }
          stream.download(a, std::span(words));
          stream.run();
          wrong -= words == Words(n, value) ? 1 : 0;
        }
      });
    }
  }
  EXPECT_EQ(wrong, std::vector<std::uint32_t>(threads, 0));
}

}  // namespace palpate::gpu::run_queue_test
