#include <gtest/gtest.h>

#include <random>

#include "driver/serial_profile.hpp"
#include "receiver.hpp"
#include "sent_frame.hpp"

namespace palpate::packet_deframer_test {

class ShippedBoard : public testing::TestWithParam<const char*> {
 protected:
  std::vector<SentFrame> random_frames(std::size_t count) {
    std::vector<SentFrame> frames;
    for (std::size_t i = 0; i < count; ++i) {
      frames.push_back(random_frame(board_, random_));
    }
    return frames;
  }
  // Without a checksum, the damaged frame and one more may have wrong values.
  std::size_t most_strangers() const { return board_ == "wts" ? 0 : 2; }

  const std::string board_ = GetParam();
  const SerialProfile profile_ = read_serial_profile(board_);
  std::mt19937 random_{17};
};

TEST_P(ShippedBoard, StreamArrivesWhole) {
  const std::vector<SentFrame> sent = random_frames(50);
  Receiver receiver(profile_);
  receiver.send(sent);
  receiver.expect_exactly(sent);
  EXPECT_EQ(receiver.garbage(), 0u);
  EXPECT_EQ(receiver.checksum_errors(), 0u);
}

TEST_P(ShippedBoard, StreamMayBeSplitAtEveryByte) {
  const std::vector<SentFrame> sent = random_frames(3);
  const Bytes stream = stream_of(sent);
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    const auto middle = stream.begin() + static_cast<std::ptrdiff_t>(cut);
    Receiver receiver(profile_);
    receiver.push(Bytes(stream.begin(), middle));
    receiver.push(Bytes{});
    receiver.push(Bytes(middle, stream.end()));
    receiver.expect_exactly(sent);
    ASSERT_EQ(receiver.garbage(), 0u) << "cut at " << cut;
  }
}

TEST_P(ShippedBoard, FrameComesWithItsLastByte) {
  const std::vector<SentFrame> sent = random_frames(4);
  Receiver receiver(profile_);
  for (const SentFrame& frame : sent) {
    receiver.clear();
    for (std::size_t i = 0; i + 1 < frame.bytes.size(); ++i) {
      receiver.push(Bytes{frame.bytes[i]});
    }
    // The bytes of one frame may end with a packet of acceleration behind the values.
    if (board_ != "tsf85") {
      EXPECT_TRUE(receiver.frames().empty());
    }
    receiver.push(Bytes{frame.bytes.back()});
    receiver.expect_exactly({frame});
  }
}

// The first piece of a running stream is rarely the beginning of a frame.
TEST_P(ShippedBoard, StreamMayBeginAnywhere) {
  const std::vector<SentFrame> sent = random_frames(4);
  const Bytes stream = stream_of(sent);
  for (std::size_t begin = 1; begin < sent[0].bytes.size(); ++begin) {
    Receiver receiver(profile_);
    receiver.push(Bytes(stream.begin() + static_cast<std::ptrdiff_t>(begin), stream.end()));
    ASSERT_TRUE(receiver.has(sent, 2, 4)) << "from " << begin;
    ASSERT_EQ(receiver.strangers(sent), 0u) << "from " << begin;
  }
}

TEST_P(ShippedBoard, IsInStepTwoFramesAfterGarbage) {
  for (std::size_t count = 1; count <= 300; ++count) {
    const std::vector<SentFrame> sent = random_frames(8);
    const Bytes garbage = random_bytes(count, random_);
    Receiver receiver(profile_);
    receiver.send({sent.begin(), sent.begin() + 3});
    receiver.push(garbage);
    // A format without checksum accepts a frame when the next frame's beginning follows.
    receiver.send({sent.begin() + 3, sent.end()});
    ASSERT_TRUE(receiver.has(sent, 0, 3)) << count;
    ASSERT_TRUE(receiver.has(sent, 5, 8)) << count;
    ASSERT_EQ(receiver.strangers(sent), 0u) << count;
    ASSERT_GE(receiver.garbage(), count);
  }
}

TEST_P(ShippedBoard, IsInStepTwoFramesAfterBytesWereLost) {
  const std::vector<SentFrame> sent = random_frames(8);
  const std::size_t size = sent[3].bytes.size();
  for (std::size_t lost_from = 0; lost_from < size; lost_from += 3) {
    const std::size_t lost = std::min<std::size_t>(1 + random_() % 70, size - lost_from);
    std::vector<SentFrame> damaged = sent;
    const auto begin = damaged[3].bytes.begin() + static_cast<std::ptrdiff_t>(lost_from);
    damaged[3].bytes.erase(begin, begin + static_cast<std::ptrdiff_t>(lost));
    Receiver receiver(profile_);
    receiver.send(damaged);
    ASSERT_TRUE(receiver.has(sent, 0, 3)) << lost_from;
    ASSERT_TRUE(receiver.has(sent, 5, 8)) << lost_from;
    ASSERT_LE(receiver.strangers(sent), most_strangers()) << lost_from;
  }
}

TEST_P(ShippedBoard, IsInStepTwoFramesAfterBytesCameBetween) {
  const std::vector<SentFrame> sent = random_frames(8);
  for (std::size_t at = 0; at < sent[3].bytes.size(); at += 3) {
    const Bytes garbage = random_bytes(1 + random_() % 70, random_);
    std::vector<SentFrame> damaged = sent;
    damaged[3].bytes.insert(damaged[3].bytes.begin() + static_cast<std::ptrdiff_t>(at),
                            garbage.begin(), garbage.end());
    Receiver receiver(profile_);
    receiver.send(damaged);
    ASSERT_TRUE(receiver.has(sent, 0, 3)) << at;
    ASSERT_TRUE(receiver.has(sent, 5, 8)) << at;
    ASSERT_LE(receiver.strangers(sent), most_strangers()) << at;
  }
}

TEST_P(ShippedBoard, ForgetsItsPartOfAFrameAtReset) {
  const std::vector<SentFrame> sent = random_frames(3);
  Receiver receiver(profile_);
  receiver.push(Bytes(sent[0].bytes.begin(), sent[0].bytes.begin() + 20));
  receiver.reset();
  receiver.send({sent.begin() + 1, sent.end()});
  receiver.expect_exactly({sent.begin() + 1, sent.end()});
  EXPECT_EQ(receiver.garbage(), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedBoard,
                         testing::Values("tsf85", "wts", "flexitac", "flexitac12", "anyskin"),
                         [](const auto& board) { return std::string(board.param); });

}  // namespace palpate::packet_deframer_test
