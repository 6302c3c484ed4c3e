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
  TransferRing::Counters counters_;
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
  // More transfers than the ring keeps spare buffers for.
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

TEST_F(Ring, NeedsNoMemoryForAsMuchAsWasRecycled) {
  for (int round = 0; round < 4; ++round) {
    for (const std::uint8_t i : {0, 1, 2, 3, 4}) {
      board_.usb().send(Bytes(1, i));
    }
    ASSERT_TRUE(pump(/*has_memory=*/round == 0));
    std::vector<Completion> completions = ring_->completed();
    ASSERT_EQ(completions.size(), 5U) << round;
    for (const std::uint8_t i : {0, 1, 2, 3, 4}) {
      EXPECT_EQ(completions[i].bytes, Bytes(1, i));
      EXPECT_EQ(completions[i].missing, 0U);
    }
    ring_->recycle(std::move(completions));
  }
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

}  // namespace palpate::transfer_ring_test
