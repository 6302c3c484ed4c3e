#include <gtest/gtest.h>

#include <future>
#include <optional>
#include <stdexcept>

#include "driver/queued_sensor.hpp"
#include "driver/usb_device.hpp"
#include "fake_takktile.hpp"
#include "palpate/error.hpp"
#include "streamed.hpp"
#include "without_memory.hpp"

namespace palpate::transfer_ring_test {

using Completion = TransferRing::Completion;

/// A ring whose events this thread handles.
class Ring : public testing::Test {
 protected:
  Ring() {
    handle_.claim(0);
    ring_.emplace(context_, handle_, std::uint8_t{0x81}, transfer_bytes, counters_);
  }

  /// Handles events until the callbacks of all sent packets have returned.
  bool pump(bool has_memory = true) {
    return becomes_true([&] {
      std::optional<WithoutMemory> none;
      if (!has_memory) {
        none.emplace();
      }
      timeval time{.tv_sec = 0, .tv_usec = 1000};
      libusb_handle_events_timeout_completed(context_.get(), &time, nullptr);
      none.reset();
      return board_.usb().seen().waiting_packets == 0;
    });
  }

  static constexpr std::size_t transfer_bytes = 512;
  FakeUsb usb_;
  FakeTakktile board_{usb_, "1", {0b11111}};
  UsbContext context_;
  UsbHandle handle_{context_, usb_devices().at(0)};
  SensorCounters counters_;
  std::optional<TransferRing> ring_;
};

TEST_F(Ring, TellsWhichTransferAPacketEnded) {
  for (const std::size_t bytes : {transfer_bytes, transfer_bytes - 64, std::size_t{3}}) {
    board_.usb().send(Bytes(bytes, 1));
  }
  ASSERT_TRUE(pump());
  std::vector<std::pair<std::size_t, bool>> completions;
  for (const Completion& completion : ring_->completed()) {
    completions.emplace_back(completion.bytes.size(), completion.ended);
  }
  // The first is full, but with full packets only.
  EXPECT_EQ(completions,
            (std::vector<std::pair<std::size_t, bool>>{
                {transfer_bytes, false}, {0, true}, {transfer_bytes - 64, true}, {3, true}}));
}

TEST_F(Ring, CountsWhatItHasNoMemoryToKeep) {
  board_.usb().send(Bytes(1, 1));
  ASSERT_TRUE(pump());
  constexpr std::uint64_t lost = 2 * TransferRing::transfers;
  for (std::uint64_t i = 0; i < lost; ++i) {
    board_.usb().send(Bytes(2, 2));
  }
  ASSERT_TRUE(pump(/*has_memory=*/false));
  board_.usb().send(Bytes(3, 3));
  ASSERT_TRUE(pump());
  const std::vector<Completion> completions = ring_->completed();
  ASSERT_EQ(completions.size(), 2U);
  EXPECT_EQ(completions[0].bytes, Bytes(1, 1));
  EXPECT_EQ(completions[0].missing, 0U);
  EXPECT_EQ(completions[1].bytes, Bytes(3, 3));
  EXPECT_EQ(completions[1].missing, lost);
  EXPECT_FALSE(ring_->lost());
}

TEST_F(Ring, EndsWithoutMemory) {
  board_.usb().send(Bytes(64, 1), /*end=*/false);  // the transfer waits for more packets
  ASSERT_TRUE(pump());
  {
    const WithoutMemory none;
    ring_->drain();
  }
  const std::vector<Completion> completions = ring_->completed();
  ASSERT_EQ(completions.size(), 1U);
  EXPECT_TRUE(completions[0].bytes.empty());
  EXPECT_EQ(completions[0].missing, 1U);
  EXPECT_FALSE(completions[0].ended);
  EXPECT_TRUE(ring_->completed().empty());
}

TEST_F(Ring, OfADeviceThatIsGoneDoesNotBegin) {
  ring_.reset();
  board_.usb().unplug();
  EXPECT_THROW(ring_.emplace(context_, handle_, std::uint8_t{0x81}, transfer_bytes, counters_),
               Error);
}

using std::chrono::milliseconds;

/// A sensor whose thread is the test's.
struct OpenSensor : QueuedSensor {
  void start() override { forget(); }
  void stop() override {}
  void send(double number) { push({.values = {number}}, 0.0); }
  std::optional<Frame> take() { return next(milliseconds(0)); }
  using QueuedSensor::fail;
  using QueuedSensor::lose;
};

TEST(QueuedSensorTest, TellsWithTheNextFrameWhatWasDropped) {
  OpenSensor sensor;
  constexpr int more = 3;
  sensor.lose(5);
  for (int i = 0; i < static_cast<int>(QueuedSensor::capacity) + more; ++i) {
    sensor.send(i);
  }
  EXPECT_EQ(sensor.counters().frames, QueuedSensor::capacity);
  EXPECT_EQ(sensor.counters().lost, static_cast<std::uint64_t>(more));
  const std::optional<Frame> first = sensor.take();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->values, std::vector<double>{more});
  EXPECT_EQ(first->lost_before, 5U + more) << "with those lost before the dropped ones";
  EXPECT_EQ(sensor.take()->lost_before, 0U);
}

TEST(QueuedSensorTest, SaysWhyNoFrameComesOnceNoneIsLeft) {
  OpenSensor sensor;
  sensor.send(1);
  try {
    throw std::runtime_error("gone");
  } catch (...) {
    sensor.fail();
  }
  EXPECT_TRUE(sensor.take());
  for (int i = 0; i < 2; ++i) {
    EXPECT_THROW(sensor.take(), std::runtime_error);
  }
  sensor.start();
  EXPECT_EQ(sensor.take(), std::nullopt);
  EXPECT_EQ(sensor.counters().frames, 0U);
}

TEST(QueuedSensorTest, WaitsAsLongAsATimeCanBe) {
  OpenSensor sensor;
  auto frame = std::async(std::launch::async, [&] { return sensor.next(milliseconds::max()); });
  // If the end of the wait overflowed into the past, next() would have returned by now.
  EXPECT_EQ(frame.wait_for(milliseconds(50)), std::future_status::timeout);
  sensor.send(1);
  ASSERT_EQ(frame.wait_for(patience), std::future_status::ready);
  EXPECT_TRUE(frame.get());
  EXPECT_EQ(sensor.next(milliseconds::min()), std::nullopt);
}

}  // namespace palpate::transfer_ring_test
