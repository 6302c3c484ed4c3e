#include <gtest/gtest.h>

#include <random>

#include "driver/serial_profile.hpp"
#include "receiver.hpp"
#include "sent_frame.hpp"

namespace palpate::packet_deframer_test {

class ShippedBoard : public testing::TestWithParam<const char*> {
 protected:
  const std::string board_ = GetParam();
  const SerialProfile profile_ = read_serial_profile(board_);
  std::mt19937 random_{17};
};

TEST_P(ShippedBoard, StreamMayBeSplitAtEveryByte) {
  const std::vector<SentFrame> sent = random_frames(board_, 3, random_);
  const Bytes stream = stream_of(sent);
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    Receiver receiver(profile_);
    receiver.push(std::span(stream).first(cut));
    receiver.push({});
    receiver.push(std::span(stream).subspan(cut));
    receiver.expect_exactly(sent);
    ASSERT_EQ(receiver.garbage(), 0u) << "cut at " << cut;
    ASSERT_EQ(receiver.checksum_errors(), 0u) << "cut at " << cut;
  }
}

TEST_P(ShippedBoard, FrameComesWithItsLastByte) {
  Receiver receiver(profile_);
  for (const SentFrame& frame : random_frames(board_, 4, random_)) {
    receiver.clear();
    for (std::size_t i = 0; i + 1 < frame.bytes.size(); ++i) {
      receiver.push(Bytes{frame.bytes[i]});
    }
    // The bytes of one frame may end with a packet of acceleration behind the values.
    EXPECT_TRUE(receiver.frames().empty() || board_ == "tsf85");
    receiver.push(Bytes{frame.bytes.back()});
    receiver.expect_exactly({frame});
  }
}

// The first piece of a running stream is rarely the beginning of a frame.
TEST_P(ShippedBoard, StreamMayBeginAnywhere) {
  const std::vector<SentFrame> sent = random_frames(board_, 4, random_);
  const Bytes stream = stream_of(sent);
  for (std::size_t begin = 1; begin < sent[0].bytes.size(); ++begin) {
    Receiver receiver(profile_);
    receiver.push(std::span(stream).subspan(begin));
    ASSERT_TRUE(receiver.has(sent, 2, 4)) << "from " << begin;
    ASSERT_EQ(receiver.strangers(sent), 0) << "from " << begin;
  }
}

TEST_P(ShippedBoard, ForgetsItsPartOfAFrameAtReset) {
  const std::vector<SentFrame> sent = random_frames(board_, 2, random_);
  Receiver receiver(profile_);
  receiver.push(std::span(sent[0].bytes).first(20));
  receiver.reset();
  receiver.send(sent);
  receiver.expect_exactly(sent);
  EXPECT_EQ(receiver.garbage(), 0u);
}

INSTANTIATE_TEST_SUITE_P(All, ShippedBoard,
                         testing::Values("tsf85", "wts", "flexitac", "flexitac12", "anyskin"),
                         [](const auto& board) { return std::string(board.param); });

}  // namespace palpate::packet_deframer_test
