#include "driver/frame_queue.hpp"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>
#include <thread>

#include "streamed.hpp"

namespace palpate::frame_queue_test {

using std::chrono::milliseconds;

Frame numbered(double number, std::uint64_t lost_before = 0) {
  return {.values = {number}, .lost_before = lost_before};
}

TEST(FrameQueueTest, TellsWithTheNextFrameWhatWasDropped) {
  FrameQueue queue;
  constexpr int more = 3;
  queue.push(numbered(-1, 5));
  for (int i = 0; i < static_cast<int>(FrameQueue::capacity) + more - 1; ++i) {
    queue.push(numbered(i));
  }
  EXPECT_EQ(queue.counters().pushed, FrameQueue::capacity + more);
  EXPECT_EQ(queue.counters().dropped, static_cast<std::uint64_t>(more));
  const std::optional<Frame> first = queue.pop(milliseconds(0));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->values, std::vector<double>{more - 1});
  EXPECT_EQ(first->lost_before, 5U + more) << "with those lost before the dropped ones";
  EXPECT_EQ(queue.pop(milliseconds(0))->lost_before, 0U);
}

TEST(FrameQueueTest, SaysWhyNoFrameComesOnceNoneIsLeft) {
  FrameQueue queue;
  queue.push(numbered(1));
  queue.fail(std::make_exception_ptr(std::runtime_error("gone")));
  EXPECT_TRUE(queue.pop(milliseconds(0)));
  for (int i = 0; i < 2; ++i) {
    EXPECT_THROW(queue.pop(milliseconds(0)), std::runtime_error);
  }
  queue.clear();
  EXPECT_EQ(queue.pop(milliseconds(0)), std::nullopt);
  EXPECT_EQ(queue.counters().pushed, 0U);
}

TEST(FrameQueueTest, WaitsAsLongAsATimeCanBe) {
  FrameQueue queue;
  auto frame = std::async(std::launch::async, [&] { return queue.pop(milliseconds::max()); });
  // If the end of the wait overflowed into the past, pop() would have returned by now.
  EXPECT_EQ(frame.wait_for(milliseconds(50)), std::future_status::timeout);
  queue.push(numbered(1));
  ASSERT_EQ(frame.wait_for(patience), std::future_status::ready);
  EXPECT_TRUE(frame.get());
  EXPECT_EQ(queue.pop(milliseconds::min()), std::nullopt);
}

}  // namespace palpate::frame_queue_test
