#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "driver/serial_profile.hpp"
#include "driver/without_memory.hpp"
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
    for (const Frame& frame : receiver.frames()) {
      ASSERT_EQ(frame.values.size(), profile_.elements_mm.size());
      ASSERT_TRUE(std::ranges::none_of(frame.values, [](double v) { return std::isinf(v); }));
    }
    ASSERT_TRUE(receiver.has(sent, 0, 3));
    ASSERT_TRUE(receiver.has(sent, 5, 8));
    // Without a checksum, the damaged frame and one more may have wrong values. That of the WTS
    // misses some pairs of flipped bits: the packet's own checksum behind it then leaves 0.
    const bool is_missed = checksum_of(weiss, damaged[3].bytes) == 0;
    const int wrong = board_ == "wts" ? (is_missed ? 1 : 0) : 2;
    ASSERT_LE(receiver.strangers(sent), between_frames ? 0 : wrong);
    ASSERT_GE(receiver.garbage() - garbage_before, garbage.size());
    ASSERT_LE(receiver.garbage() - garbage_before, stream.size());
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedBoard,
                         testing::Values("tsf85", "wts", "flexitac", "flexitac12", "anyskin"),
                         [](const auto& board) { return std::string(board.param); });

struct StreamCase {
  const char* name;
  const char* profile;
  Bytes bytes;
  std::vector<std::vector<double>> frames;
  std::uint64_t checksum_errors = 0;
  std::uint64_t garbage = 0;
};

// Boards of which each has a packet of another layout.
const StreamCase streams[] = {
    {.name = "the example that PacketDeframer is explained by",
     .profile = "name: two elements\nelements: [[0, 0], [2, 0]]\n"
                "packet: [{bytes: aa 55}, {values: u8}, {checksum: sum8, from: 2}]\n",
     .bytes = {0x31, 0xaa, 0x55, 7, 9, 0x10, 0xaa, 0x55, 0xaa, 0x55, 3, 4, 7, 0xaa, 0x55, 5, 6,
               0xff},
     .frames = {{7, 9}, {3, 4}},
     .checksum_errors = 2,
     .garbage = 1 + 2 + 5},
    {.name = "fields behind counted parts",
     .profile =
         "name: parts\nelements: [[0, 0], [2, 0]]\n"
         "packet: [{bytes: aa}, {length: u8, most: 16},\n"
         "         {parts: u8, tags: [{tag: 1, values: 2}]}, {time: u8}, {checksum: sum8}]\n",
     .bytes = {0xaa, 4, 1, 7, 9, 5, 0xc4},
     .frames = {{7, 9, 0.005}}},
    {.name = "a row in a packet, big-endian and signed, with a checksum in front",
     .profile = "name: rows\ngain: 0.25\noffset: -10\n"
                "elements: [{grid: [3, 2], pitch_mm: [2, 2]}]\n"
                "packet: [{bytes: f0 0f},\n"
                "         {checksum: crc16, polynomial: 0x1021, init: 0xffff, order: be,\n"
                "          covers: after},\n"
                "         {parts: s16be, tags: [{tag: 1, values: 3}, {tag: 2, values: 3}]}]\n",
     .bytes = {0xf0, 0x0f, 0x06, 0xa1, 1, 0x00, 0x04, 0xff, 0xfc, 0x80, 0x00,  // 4, -4, -32768
               0xf0, 0x0f, 0xee, 0x77, 2, 0x7f, 0xff, 0x00, 0x00, 0x00, 0x28,  // 32767, 0, 40
               0xf0, 0x0f, 0,    0,    1, 0,    0,    0,    0,    0,    0},
     .frames = {{-9, -11, -8202, 8181.75, -10, 0}},
     .checksum_errors = 1,
     .garbage = 11},
    {.name = "a length that counts the whole packet, with checksum and terminator",
     .profile = "name: counted\nelements: [[0, 0], [1, 0]]\n"
                "packet: [{bytes: \"02\"}, {length: u16be, extra: 6}, {values: u32be},\n"
                "         {checksum: xor8, from: 1}, {bytes: \"0303\"}]\n",
     .bytes = {0x02, 0, 14, 0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff, 14 ^ 1, 0x03, 0x03,  //
               0x02, 0, 14, 0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff, 14 ^ 1, 0x03, 0x04,  //
               0x02, 0, 5},  // shorter than the fields around the values
     .frames = {{1.0, 4294967295.0}},
     .garbage = 14 + 3}};

TEST(PacketDeframer, ReadsWhatTheProfileSaysAndCountsTheRest) {
  for (const StreamCase& stream : streams) {
    SCOPED_TRACE(stream.name);
    Receiver receiver(parse_serial_profile(stream.profile, "own.yaml"));
    receiver.push(stream.bytes);
    std::vector<std::vector<double>> frames;  // and the time of those that tell it
    for (const Frame& frame : receiver.frames()) {
      frames.push_back(frame.values);
      if (frame.device_time_s) {
        frames.back().push_back(*frame.device_time_s);
      }
    }
    EXPECT_EQ(frames, stream.frames);
    EXPECT_EQ(receiver.checksum_errors(), stream.checksum_errors);
    EXPECT_EQ(receiver.garbage(), stream.garbage);
  }
}

TEST(PacketDeframer, FindsTheLargestPacketBehindManyThatBeginLikeIt) {
  Receiver receiver(parse_serial_profile(
      "name: largest\nelements: [{grid: [128, 128], pitch_mm: [1, 1]}]\npacket: [bytes: \"00\", "
      "{values: u8, stride: 3}, {checksum: crc32, polynomial: 0x04c11db7, init: 0xffffffff}]\n",
      "largest.yaml"));
  Bytes packet(1 + 3 * 16384, 0);
  packet[1 + 3 * 16383] = 7;
  packet.insert(packet.end(), {0x58, 0xb6, 0x21, 0xa2});  // the checksum, by another program
  receiver.push(Bytes{1});                                // out of step from here on
  receiver.push(Bytes(1'000'000, 0));
  receiver.push(packet);
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.frames()[0].values.back(), 7.0);
  EXPECT_EQ(receiver.garbage(), 1'000'001u);
}

TEST(EndlessGarbage, NeedsNoMoreMemoryThanItsFirstBytes) {
  PacketDeframer deframer(read_serial_profile("wts").packet);
  std::vector<Frame> frames;
  const Bytes piece(64, 0x00);
  constexpr int pieces = 1000;
  deframer.push(piece, frames);
  deframer.push(piece, frames);
  {
    const WithoutMemory none;
    for (int i = 2; i < pieces; ++i) {
      deframer.push(piece, frames);
    }
  }
  EXPECT_EQ(deframer.counters().garbage_bytes, pieces * piece.size());
}

using Kind = Checksum::Kind;

struct ChecksumCase {
  const char* name;
  std::uint32_t expected;
  std::string_view bytes;
  Checksum checksum;
};

constexpr std::string_view check = "123456789";
constexpr std::string_view three = "\xff\x02\x10";  // 255 + 2 + 16 = 273 = 0x111

// The values named "check", over "123456789", are those of the catalogue of parametrised CRC
// algorithms; those of Weiss Robotics, of packets that its command set prints as examples.
const ChecksumCase cases[] = {
    {"CRC-8/SMBUS", 0xf4, check, {Kind::crc, 1, 0x07}},
    {"CRC-8/MAXIM", 0xa1, check, {Kind::crc, 1, 0x31, 0, 0, true}},
    {"CRC-16/CCITT-FALSE", 0x29b1, check, {Kind::crc, 2, 0x1021, 0xffff}},
    {"CRC-16/XMODEM", 0x31c3, check, {Kind::crc, 2, 0x1021}},
    {"CRC-16/MODBUS", 0x4b37, check, {Kind::crc, 2, 0x8005, 0xffff, 0, true}},
    // An asymmetric initial value shows whether it is reflected with the register.
    {"CRC-16/RIELLO", 0x63d0, check, {Kind::crc, 2, 0x1021, 0xb2aa, 0, true}},
    {"CRC-32", 0xcbf43926, check, {Kind::crc, 4, 0x04c11db7, 0xffffffff, 0xffffffff, true}},
    {"CRC-32/BZIP2", 0xfc891918, check, {Kind::crc, 4, 0x04c11db7, 0xffffffff, 0xffffffff}},
    {"Weiss 1", 0x10e8, {"\xaa\xaa\xaa\x01\x00\x00", 6}, weiss},
    {"Weiss 6", 0x2697, {"\xaa\xaa\xaa\x06\x00\x00", 6}, weiss},
    {"8-bit sum", 0x11, three, {.kind = Kind::sum, .bytes = 1}},
    {"16-bit sum", 0x111, three, {.kind = Kind::sum, .bytes = 2}},
    {"sum of all", 0xbd, three, {.kind = Kind::sum, .bytes = 1, .init = 0x31, .xor_out = 0xff}},
    {"exclusive or", 0xed, three, {.kind = Kind::exor, .bytes = 1}},
    {"begun", 0xe2, three, {.kind = Kind::exor, .bytes = 1, .init = 0x0f}},
    {"CRC of nothing", 0xffff, "", {Kind::crc, 2, 0x1021, 0xffff}},
    {"sum of nothing", 0, "", {.kind = Kind::sum, .bytes = 1}}};

TEST(Checksum, GivesThePublishedValues) {
  for (const ChecksumCase& row : cases) {
    const Bytes bytes(row.bytes.begin(), row.bytes.end());
    EXPECT_EQ(checksum_of(row.checksum, bytes), row.expected) << row.name;
  }
}

}  // namespace palpate::packet_deframer_test
