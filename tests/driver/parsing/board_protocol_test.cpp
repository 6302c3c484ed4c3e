#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "driver/serial_profile.hpp"
#include "palpate/error.hpp"
#include "receiver.hpp"
#include "sent_frame.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::board_protocol_test {

TEST(Wts, DropsAPacketWithAWrongChecksumAndCountsIt) {
  std::mt19937 random(3);
  std::vector<SentFrame> sent;
  for (int i = 0; i < 3; ++i) {
    sent.push_back(random_frame("wts", random));
  }
  for (std::size_t at = 0; at < sent[1].bytes.size(); ++at) {
    std::vector<SentFrame> damaged = sent;
    damaged[1].bytes[at] ^= 0x10;
    Receiver receiver(read_serial_profile("wts"));
    receiver.send(damaged);
    receiver.expect_exactly({sent[0], sent[2]});
    // Bytes 0 to 2 are the preamble; a change of byte 4 or 5 makes the length larger than allowed.
    EXPECT_EQ(receiver.checksum_errors(), at < 3 || at == 4 || at == 5 ? 0u : 1u) << at;
    EXPECT_EQ(receiver.garbage(), sent[1].bytes.size()) << at;
  }
}

// Out of step, most bytes that look like a packet's beginning are not.
TEST(Wts, CountsAWrongChecksumOnlyInStep) {
  Receiver receiver(read_serial_profile("wts"));
  Bytes damaged = wts_packet(0x21, {0x00, 0x00});
  damaged.back() ^= 1;
  receiver.push(Bytes{0x01});
  receiver.push(damaged);
  EXPECT_EQ(receiver.checksum_errors(), 0u);
  receiver.push(wts_packet(0x21, {0x00, 0x00}));
  receiver.push(damaged);
  EXPECT_EQ(receiver.checksum_errors(), 1u);
}

TEST(Wts, PassesOverAnswersToCommands) {
  std::mt19937 random(4);
  const SentFrame frame = random_frame("wts", random);
  Receiver receiver(read_serial_profile("wts"));
  receiver.push(wts_packet(0x21, {0x00, 0x00}));
  receiver.send({frame});
  receiver.push(wts_packet(0x30, {0, 0, 6, 0, 14, 0, 0x54, 1, 0x54, 1, 0xff, 0x0f}));
  receiver.send({frame});
  receiver.expect_exactly({frame, frame});
  EXPECT_EQ(receiver.garbage(), 0u);
}

TEST(Wts, PassesOverCompressedFramesAndCountsThoseOfAnotherMatrix) {
  Bytes compressed(5 + 168, 0);
  compressed[4] = 1;
  Receiver receiver(read_serial_profile("wts"));
  receiver.push(wts_packet(0x00, compressed));
  EXPECT_EQ(receiver.garbage(), 0u);
  const Bytes smaller = wts_packet(0x00, Bytes(5 + 2 * 32, 0));
  receiver.push(smaller);
  EXPECT_EQ(receiver.garbage(), smaller.size());
  EXPECT_EQ(receiver.checksum_errors(), 0u);
  EXPECT_TRUE(receiver.frames().empty());
}

TEST(Wts, TellsTheTimeOfTheBoard) {
  Bytes payload(5 + 168, 0);
  payload[0] = 0x39;  // 0x00003039 = 12345 ms
  payload[1] = 0x30;
  Receiver receiver(read_serial_profile("wts"));
  receiver.push(wts_packet(0x00, payload));
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_DOUBLE_EQ(receiver.frames()[0].device_time_s.value(), 12.345);
}

TEST(Wts, FindsItsWayOutOfFalsePreambles) {
  std::mt19937 random(5);
  for (std::size_t length = 0; length <= 0xff; ++length) {
    std::vector<SentFrame> sent;
    for (int i = 0; i < 3; ++i) {
      sent.push_back(random_frame("wts", random));
    }
    Receiver receiver(read_serial_profile("wts"));
    receiver.push(Bytes{0xaa, 0xaa, 0xaa, 0xaa, 0x00, static_cast<std::uint8_t>(length), 0x00});
    receiver.send(sent);
    EXPECT_TRUE(receiver.has(sent, 1, 3)) << length;
    EXPECT_EQ(receiver.strangers(sent), 0u) << length;
  }
}

// The commands that start and stop the stream are packets, too.
TEST(Wts, CommandsCarryRightChecksums) {
  const SerialProfile profile = read_serial_profile("wts");
  EXPECT_EQ(profile.start, wts_packet(0x21, {0x00, 20, 0x00}));
  EXPECT_EQ(profile.stop, wts_packet(0x22, {}));
}

// Packets that the tests of wts-ft list (CNCR-NTU/wts-ft, src/wts_ft/wts_ft_interface.py).
TEST(Wts, PacketsEndInThePublishedChecksums) {
  const std::vector<std::pair<Bytes, std::uint16_t>> published = {
      {wts_packet(0x01, {0x12, 0x34}), 0x666d},
      {wts_packet(0x01, {}), 0x10e8},
      {wts_packet(0x06, {}), 0x2697}};
  for (const auto& [packet, checksum] : published) {
    EXPECT_EQ(packet[packet.size() - 2] | packet.back() << 8, checksum);
  }
}

/// A FlexiTac frame of zeros except for these bytes of the payload.
Bytes flexitac(std::initializer_list<std::pair<std::size_t, std::uint8_t>> set) {
  Bytes bytes(514, 0);
  bytes[0] = 0xaa;
  bytes[1] = 0x55;
  for (const auto& [at, value] : set) {
    bytes[2 + at] = value;
  }
  return bytes;
}

TEST(FlexiTac, IsNotMisledByMarkersInThePayload) {
  const SerialProfile profile = read_serial_profile("flexitac");
  Receiver receiver(profile);
  receiver.push(Bytes(100, 0x00));
  for (std::size_t i = 0; i < 6; ++i) {
    // The markers change their place from frame to frame.
    receiver.push(flexitac({{40 * i, 0xaa}, {40 * i + 1, 0x55}}));
  }
  ASSERT_EQ(receiver.frames().size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(receiver.frames()[i].values[40 * i], 0xaa);
  }
  EXPECT_EQ(receiver.garbage(), 100u);
}

TEST(FlexiTac, BelievesAMarkerOnceAnotherFollows) {
  Receiver receiver(read_serial_profile("flexitac"));
  receiver.push(Bytes{0x00});
  receiver.push(flexitac({{7, 9}}));
  EXPECT_TRUE(receiver.frames().empty());
  receiver.push(Bytes{0xaa});
  EXPECT_TRUE(receiver.frames().empty());
  receiver.push(Bytes{0x55});
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.frames()[0].values[7], 9.0);
}

TEST(FlexiTac, LeavesAFalseMarkerWhenItChanges) {
  const Bytes misleading = flexitac({{200, 0xaa}, {201, 0x55}});
  Receiver receiver(read_serial_profile("flexitac"));
  receiver.push(Bytes(misleading.begin() + 100, misleading.end()));  // joins within a frame
  receiver.push(misleading);
  receiver.push(misleading);
  receiver.push(flexitac({}));
  receiver.clear();
  receiver.push(flexitac({{3, 9}}));
  receiver.push(flexitac({{4, 9}}));
  receiver.push(flexitac({{5, 9}}));
  ASSERT_FALSE(receiver.frames().empty());
  EXPECT_EQ(receiver.frames().back().values[5], 9.0);
}

TEST(AnySkin, PassesOnWhatIsNoNumber) {
  std::mt19937 random(6);
  const SentFrame frame = random_frame("anyskin", random);
  for (const Bytes& pattern : {Bytes{0x00, 0x00, 0x80, 0x7f}, Bytes{0x00, 0x00, 0x80, 0xff},
                               Bytes{0x01, 0x00, 0xc0, 0xff}}) {
    Bytes damaged = frame.bytes;
    constexpr std::size_t bytes_of_chip = 16;
    constexpr std::size_t chip = 2;
    std::copy(pattern.begin(), pattern.end(), damaged.begin() + chip * bytes_of_chip + 12);
    Receiver receiver(read_serial_profile("anyskin"));
    receiver.push(damaged);
    receiver.send({frame});
    ASSERT_EQ(receiver.frames().size(), 2u) << "one dead chip does not end the stream";
    for (std::size_t element = 0; element < frame.values.size(); ++element) {
      const double value = receiver.frames()[0].values.at(element);
      EXPECT_TRUE(element == chip ? std::isnan(value) : value == frame.values[element]) << value;
    }
    EXPECT_EQ(receiver.frames()[1].values, frame.values);
    EXPECT_EQ(receiver.garbage(), 0u);
  }
}

class Tsf85 : public testing::Test {
 protected:
  static Bytes finger(int index, std::uint8_t value) {
    Bytes packet{0x9a, 0x00, 0x58, 57, static_cast<std::uint8_t>(0x10 | index << 2)};
    for (int i = 0; i < 28; ++i) {
      packet.insert(packet.end(), {0x00, value});
    }
    return packet;
  }

  /// A packet of the board's clock, and of other bytes behind it.
  static Bytes clock(std::uint64_t ticks, const Bytes& rest = {}) {
    Bytes packet{0x9a, 0x00, 0x58, static_cast<std::uint8_t>(9 + rest.size()), 0x70};
    for (int shift = 56; shift >= 0; shift -= 8) {
      packet.push_back(static_cast<std::uint8_t>(ticks >> shift));
    }
    packet.insert(packet.end(), rest.begin(), rest.end());
    return packet;
  }

  Receiver receiver_{read_serial_profile("tsf85")};
};

TEST_F(Tsf85, PairsTheFingersOfOneFrame) {
  receiver_.push(finger(0, 1));
  receiver_.push(finger(1, 2));
  receiver_.push(finger(1, 4));  // its finger 0 was lost
  receiver_.push(finger(0, 5));  // its finger 1 was lost
  receiver_.push(finger(0, 7));
  receiver_.push(finger(1, 8));
  ASSERT_EQ(receiver_.frames().size(), 2u);
  EXPECT_EQ(receiver_.frames()[0].values.front(), 1.0);
  EXPECT_EQ(receiver_.frames()[0].values.back(), 2.0);
  EXPECT_EQ(receiver_.frames()[1].values.front(), 7.0);
  EXPECT_EQ(receiver_.frames()[1].values.back(), 8.0);
  EXPECT_EQ(receiver_.garbage(), 0u);
}

TEST_F(Tsf85, DoesNotPairFingersAcrossALoss) {
  receiver_.push(finger(0, 1));
  receiver_.push(Bytes{0x00});
  receiver_.push(finger(1, 4));
  receiver_.push(finger(0, 7));
  receiver_.push(finger(1, 8));
  ASSERT_EQ(receiver_.frames().size(), 1u);
  EXPECT_EQ(receiver_.frames()[0].values.front(), 7.0);
}

TEST_F(Tsf85, MayHoldThePreambleInItsPayload) {
  for (int i = 0; i < 4; ++i) {
    receiver_.push(finger(0, 0x9a));
    receiver_.push(finger(1, 0x9a));
  }
  EXPECT_EQ(receiver_.frames().size(), 4u);
  EXPECT_EQ(receiver_.garbage(), 0u);
}

TEST_F(Tsf85, LaysTheTaxelsOutInSevenRowsOfFourFromTheTop) {
  const std::vector<glm::dvec2> elements = read_serial_profile("tsf85").elements_mm;
  for (int i = 0; i < 28; ++i) {
    EXPECT_NEAR(elements[i].x, 3.2 * (i % 4 - 1.5), 1e-12) << i;
    EXPECT_NEAR(elements[i].y, 3.2 * (3 - i / 4), 1e-12) << i;
    EXPECT_EQ(elements[28 + i], elements[i] + glm::dvec2(0.0, 100.0)) << i;
  }
}

TEST_F(Tsf85, TellsItsClockInTheUnitThatFitsTheRate) {
  // Frames at 100 Hz; the last time stamp is of a frame after one that was lost.
  for (const std::uint64_t unit : {1'000ULL, 1'000'000ULL, 1'000'000'000ULL}) {
    Receiver receiver(read_serial_profile("tsf85"));
    for (const double time_s : {5.0, 5.01, 5.03}) {
      receiver.push(clock(static_cast<std::uint64_t>(std::llround(time_s * unit))));
      receiver.push(finger(0, 1));
      receiver.push(finger(1, 2));
    }
    receiver.push(finger(0, 1));  // no clock came with this frame
    receiver.push(finger(1, 2));
    ASSERT_EQ(receiver.frames().size(), 4u);
    EXPECT_FALSE(receiver.frames()[0].device_time_s) << "one time stamp tells no unit";
    EXPECT_NEAR(receiver.frames()[1].device_time_s.value(), 5.01, 1e-9) << unit;
    EXPECT_NEAR(receiver.frames()[2].device_time_s.value(), 5.03, 1e-9) << unit;
    EXPECT_FALSE(receiver.frames()[3].device_time_s);
    EXPECT_EQ(receiver.garbage(), 0u);
  }
}

TEST_F(Tsf85, KeepsWhatComesBeforeAnUnknownTag) {
  receiver_.push(clock(1000, {0xf1, 1, 2, 3}));
  receiver_.push(clock(1010, {0xf1, 1, 2, 3}));
  Bytes first = finger(0, 1);
  first[3] += 3;
  first.insert(first.end(), {0x80, 0x9a, 0x00});
  receiver_.push(first);
  receiver_.push(finger(1, 2));
  ASSERT_EQ(receiver_.frames().size(), 1u);
  EXPECT_EQ(receiver_.frames()[0].values.front(), 1.0);
  EXPECT_NEAR(receiver_.frames()[0].device_time_s.value(), 1.01, 1e-12);
  EXPECT_EQ(receiver_.garbage(), 0u);
}

TEST_F(Tsf85, RefusesTagsAndLengthsThatAreNone) {
  for (const Bytes& packet : {
           Bytes{0x9a, 0x00, 0x58, 61},                      // longer than any packet
           Bytes{0x9a, 0x00, 0x58, 3, 0xf0, 1, 2},           // unknown tag
           Bytes{0x9a, 0x00, 0x58, 5, 0x20, 1, 2, 0x30, 1},  // cut short
           Bytes{0x9a, 0x00, 0x57, 3, 0x20, 1, 2},           // another command
       }) {
    Receiver receiver(read_serial_profile("tsf85"));
    receiver.push(packet);
    receiver.push(finger(0, 1));
    receiver.push(finger(1, 2));
    receiver.push(finger(0, 3));
    EXPECT_EQ(receiver.frames().size(), 1u);
    EXPECT_EQ(receiver.garbage(), packet.size());
  }
}

// An imaginary board: 2 x 3 cells, a packet per row, big-endian, signed, in kPa, with a checksum in
// front that covers the bytes behind it.
constexpr const char* rows_of_a_users_board = R"(
name: rows
gain: 0.25
offset: -10
unit: kPa
elements: [{grid: [3, 2], pitch_mm: [2, 2]}]
packet:
  - bytes: f0 0f
  - {checksum: crc16, polynomial: 0x1021, init: 0xffff, order: be, covers: after}
  - {parts: s16be, tags: [{tag: 1, values: 3}, {tag: 2, values: 3}]}
)";

TEST(OwnBoard, MaySendRowsWithAChecksumInFront) {
  Receiver receiver(parse_serial_profile(rows_of_a_users_board, "rows.yaml"));
  const Checksum crc({.bytes = 2, .polynomial = 0x1021, .init = 0xffff});
  const auto push_row = [&](const Bytes& row) {
    const std::uint32_t sum = crc(row);
    Bytes packet{0xf0, 0x0f, static_cast<std::uint8_t>(sum >> 8), static_cast<std::uint8_t>(sum)};
    packet.insert(packet.end(), row.begin(), row.end());
    receiver.push(packet);
  };
  push_row({1, 0x00, 0x04, 0xff, 0xfc, 0x80, 0x00});  // 4, -4, -32768
  push_row({2, 0x7f, 0xff, 0x00, 0x00, 0x00, 0x28});  // 32767, 0, 40
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.frames()[0].values, (std::vector<double>{-9, -11, -8202, 8181.75, -10, 0}));
  receiver.push(Bytes{0xf0, 0x0f, 0, 0, 1, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(receiver.checksum_errors(), 1u);
}

// A board whose length field counts the whole packet: preamble, checksum and terminator, too.
constexpr const char* counted_board = R"(
name: counted
elements: [[0, 0], [1, 0]]
packet:
  - bytes: "02"
  - {length: u16be, extra: 6}
  - values: u32be
  - {checksum: xor8, from: 1}
  - skip: 1
  - bytes: "0303"
)";

TEST(OwnBoard, MayNotSkipBehindItsChecksum) {
  // `skip` ends the tail: the checksum's place would be known only in packets with values.
  EXPECT_THROW(parse_serial_profile(counted_board, "counted.yaml"), Error);
}

TEST(OwnBoard, MayCountTheWholePacket) {
  std::string yaml = counted_board;
  yaml.erase(yaml.find("  - skip: 1\n"), 12);
  Receiver receiver(parse_serial_profile(yaml, "counted.yaml"));
  Bytes packet{0x02, 0x00, 14, 0, 0, 0, 1, 0xff, 0xff, 0xff, 0xff};
  packet.insert(packet.end(), {14 ^ 1, 0x03, 0x03});
  receiver.push(packet);
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.frames()[0].values, (std::vector<double>{1.0, 4294967295.0}));
  packet.back() = 0x04;
  receiver.push(packet);
  EXPECT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.garbage(), packet.size());
  receiver.push(Bytes{0x02, 0x00, 5});  // shorter than the fields around the values
  EXPECT_EQ(receiver.garbage(), packet.size() + 3);
}

TEST(OwnBoard, OfTheDocumentsWorksAsPrinted) {
  const std::string page = bytes_of(PALPATE_SOURCE_DIR "/docs/boards.md");
  const std::size_t begin = page.find("name: My board");
  ASSERT_NE(begin, std::string::npos);
  const std::string yaml = page.substr(begin, page.find("```", begin) - begin);
  Receiver receiver(parse_serial_profile(yaml, "boards.md"));

  Bytes packet{0xaa, 0x55, 1 + 4 + 32, 0x01, 0x40, 0x42, 0x0f, 0x00};  // 1,000,000 us
  for (int cell = 0; cell < 16; ++cell) {
    packet.insert(packet.end(), {static_cast<std::uint8_t>(20 * cell), 0x00});
  }
  const Checksum crc({.bytes = 2, .polynomial = 0x1021, .init = 0xffff});
  const std::uint32_t sum = crc(std::span(packet).subspan(2));
  packet.insert(packet.end(),
                {static_cast<std::uint8_t>(sum >> 8), static_cast<std::uint8_t>(sum)});
  receiver.push(packet);
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_DOUBLE_EQ(receiver.frames()[0].device_time_s.value(), 1.0);
  EXPECT_DOUBLE_EQ(receiver.frames()[0].values[12], 12.0);  // 20 * 12 = 240 fits a byte
}

}  // namespace palpate::board_protocol_test
