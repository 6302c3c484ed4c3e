#include "driver/transfer_ring.hpp"

#include <gtest/gtest.h>

#include <optional>

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
  bool pump() {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (board_.usb().waiting_packets() > 0 && std::chrono::steady_clock::now() < end) {
      timeval time{.tv_sec = 0, .tv_usec = 1000};
      libusb_handle_events_timeout_completed(context_.get(), &time, nullptr);
    }
    return board_.usb().waiting_packets() == 0;
  }

  static constexpr std::size_t transfer_bytes = 512;
  FakeUsb usb_;
  FakeTakktile board_{usb_, "1", {0b11111}};
  UsbContext context_;
  UsbHandle handle_{context_, usb_devices().at(0)};
  TransferRing::Counters counters_;
  std::optional<TransferRing> ring_;
};

TEST_F(Ring, TellsWhichTransferAPacketEnded) {
  for (const std::size_t bytes : {transfer_bytes, transfer_bytes - 64, std::size_t{3}}) {
    board_.usb().send_message(Bytes(bytes, 1));
  }
  ASSERT_TRUE(pump());
  const std::vector<Completion> completions = ring_->completed();
  ASSERT_EQ(completions.size(), 4U);
  EXPECT_EQ(completions[0].bytes.size(), transfer_bytes);
  EXPECT_FALSE(completions[0].ended) << "full, but with full packets only";
  EXPECT_TRUE(completions[1].bytes.empty());
  EXPECT_TRUE(completions[1].ended);
  EXPECT_EQ(completions[2].bytes.size(), transfer_bytes - 64);
  EXPECT_TRUE(completions[2].ended);
  EXPECT_EQ(completions[3].bytes.size(), 3U);
  EXPECT_TRUE(completions[3].ended);
}

TEST_F(Ring, CountsWhatItHasNoMemoryToKeep) {
  board_.usb().send_packet(Bytes(1, 1));
  ASSERT_TRUE(pump());
  // More transfers than the ring keeps spare buffers for.
  constexpr std::uint64_t lost = 2 * TransferRing::transfers;
  for (std::uint64_t i = 0; i < lost; ++i) {
    board_.usb().send_packet(Bytes(2, 2));
  }
  {
    const WithoutMemory none;
    pump();
  }
  board_.usb().send_packet(Bytes(3, 3));
  ASSERT_TRUE(pump());
  const std::vector<Completion> completions = ring_->completed();
  ASSERT_EQ(completions.size(), 2U);
  EXPECT_EQ(completions[0].bytes, Bytes(1, 1));
  EXPECT_EQ(completions[0].missing, 0U);
  EXPECT_EQ(completions[1].bytes, Bytes(3, 3));
  EXPECT_EQ(completions[1].missing, lost);
  EXPECT_FALSE(ring_->lost());
}

TEST_F(Ring, NeedsNoMemoryForAsMuchAsWasRecycled) {
  constexpr int packets = 5;
  const auto send = [&] {
    for (int i = 0; i < packets; ++i) {
      board_.usb().send_packet(Bytes(1, static_cast<std::uint8_t>(i)));
    }
  };
  send();
  ASSERT_TRUE(pump());
  std::vector<Completion> completions = ring_->completed();
  for (int round = 0; round < 3; ++round) {
    ASSERT_EQ(completions.size(), static_cast<std::size_t>(packets));
    for (int i = 0; i < packets; ++i) {
      EXPECT_EQ(completions[static_cast<std::size_t>(i)].bytes,
                Bytes(1, static_cast<std::uint8_t>(i)));
      EXPECT_EQ(completions[static_cast<std::size_t>(i)].missing, 0U);
    }
    ring_->recycle(std::move(completions));
    send();
    {
      const WithoutMemory none;
      pump();
    }
    completions = ring_->completed();
  }
}

TEST_F(Ring, EndsWithoutMemory) {
  board_.usb().send_packet(Bytes(64, 1));  // the transfer waits for more packets
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

}  // namespace palpate::transfer_ring_test
