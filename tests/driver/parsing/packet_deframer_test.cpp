#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "driver/serial_profile.hpp"
#include "receiver.hpp"
#include "sent_frame.hpp"
#include "support/trials.hpp"

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

// None may crash or read out of bounds, which the sanitizers watch.
TEST_P(ShippedBoard, IsInStepTwoFramesAfterDamage) {
  Receiver receiver(profile_);
  // To make a frame takes longer than to parse it.
  const std::vector<SentFrame> pool = random_frames(board_, 300, random_);
  for (int trial = 0; trial < trials(1500); ++trial) {
    const auto first = pool.begin() + static_cast<std::ptrdiff_t>(random_() % (pool.size() - 8));
    const std::vector<SentFrame> sent(first, first + 8);
    std::vector<SentFrame> damaged = sent;
    const bool between_frames = trial % (kinds_of_damage + 1) == kinds_of_damage;
    const Bytes garbage = random_bytes(between_frames ? 1 + random_() % 300 : 0, random_);
    if (between_frames) {
      damaged[3].bytes.insert(damaged[3].bytes.begin(), garbage.begin(), garbage.end());
    } else {
      damage(damaged[3].bytes, static_cast<Damage>(trial % (kinds_of_damage + 1)), random_);
    }
    receiver.clear();
    const std::uint64_t garbage_before = receiver.garbage();
    const Bytes stream = stream_of(damaged);
    receiver.push_in_pieces(stream, [&] { return 1 + random_() % 200; });
    SCOPED_TRACE(trial);
    for (const ParsedFrame& frame : receiver.frames()) {
      ASSERT_EQ(frame.values.size(), profile_.elements_mm.size());
      ASSERT_TRUE(std::ranges::none_of(frame.values, [](double v) { return std::isinf(v); }));
    }
    ASSERT_TRUE(receiver.has(sent, 0, 3));
    ASSERT_TRUE(receiver.has(sent, 5, 8));
    // Without a checksum, the damaged frame and one more may have wrong values. That of the WTS
    // misses some pairs of flipped bits: the packet's own checksum behind it then leaves 0.
    const bool is_missed = weiss_checksum(damaged[3].bytes) == 0;
    const int wrong = board_ == "wts" ? (is_missed ? 1 : 0) : 2;
    ASSERT_LE(receiver.strangers(sent), between_frames ? 0 : wrong);
    ASSERT_GE(receiver.garbage() - garbage_before, garbage.size());
    ASSERT_LE(receiver.garbage() - garbage_before, stream.size());
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

// The example that PacketDeframer is explained by.
TEST(PacketDeframer, FindsItsPlaceAgainBehindLostAndWrongBytes) {
  Receiver receiver(
      parse_serial_profile("name: two elements\nelements: [[0, 0], [2, 0]]\n"
                           "packet: [{bytes: aa 55}, {values: u8}, {checksum: sum8, from: 2}]\n",
                           "example.yaml"));
  receiver.push(
      Bytes{0x31, 0xaa, 0x55, 7, 9, 0x10, 0xaa, 0x55, 0xaa, 0x55, 3, 4, 7, 0xaa, 0x55, 5, 6, 0xff});
  ASSERT_EQ(receiver.frames().size(), 2u);
  EXPECT_EQ(receiver.frames()[0].values, (std::vector<double>{7, 9}));
  EXPECT_EQ(receiver.frames()[1].values, (std::vector<double>{3, 4}));
  EXPECT_EQ(receiver.checksum_errors(), 2u);
  EXPECT_EQ(receiver.garbage(), 1u + 2u + 5u);
}

TEST(PacketDeframer, FindsTheFieldsBehindCountedParts) {
  Receiver receiver(parse_serial_profile(
      "name: parts\nelements: [[0, 0], [2, 0]]\n"
      "packet: [{bytes: aa}, {length: u8, most: 16}, {parts: u8, tags: [{tag: 1, values: 2}]},\n"
      "         {time: u8}, {checksum: sum8}]\n",
      "parts.yaml"));
  receiver.push(Bytes{0xaa, 4, 1, 7, 9, 5, 0xc4});
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.frames()[0].values, (std::vector<double>{7, 9}));
  EXPECT_NEAR(receiver.frames()[0].device_time_s.value(), 0.005, 1e-12);
}

}  // namespace palpate::packet_deframer_test
