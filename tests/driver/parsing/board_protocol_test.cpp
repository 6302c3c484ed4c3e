#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "driver/serial_profile.hpp"
#include "receiver.hpp"
#include "sent_frame.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::board_protocol_test {

TEST(Wts, DropsAPacketWithAWrongChecksumAndCountsItInStep) {
  std::mt19937 random(3);
  const std::vector<SentFrame> sent = random_frames("wts", 3, random);
  for (std::size_t at = 0; at < sent[1].bytes.size(); ++at) {
    SCOPED_TRACE(at);
    std::vector<SentFrame> damaged = sent;
    damaged[1].bytes[at] ^= 0x10;
    Receiver receiver(read_serial_profile("wts"));
    receiver.send(damaged);
    receiver.expect_exactly({sent[0], sent[2]});
    // Bytes 0 to 2 are the preamble; a change of byte 4 or 5 makes the length larger than allowed.
    EXPECT_EQ(receiver.checksum_errors(), at < 3 || at == 4 || at == 5 ? 0u : 1u);
    EXPECT_EQ(receiver.garbage(), sent[1].bytes.size());
    // Out of step, most bytes that look like a packet's beginning are not.
    Receiver out_of_step(read_serial_profile("wts"));
    out_of_step.push(Bytes{0x01});
    out_of_step.push(damaged[1].bytes);
    EXPECT_EQ(out_of_step.checksum_errors(), 0u);
  }
}

TEST(Wts, PassesOverOtherPacketsAndCountsFramesOfAnotherMatrix) {
  Bytes compressed(5 + 168, 0);
  compressed[4] = 1;
  const Bytes smaller = wts_packet(0x00, Bytes(5 + 2 * 32, 0));
  std::mt19937 random(4);
  const SentFrame frame = random_frame("wts", random);
  for (const Bytes& other : {wts_packet(0x21, {0x00, 0x00}),
                             wts_packet(0x30, {0, 0, 6, 0, 14, 0, 0x54, 1, 0x54, 1, 0xff, 0x0f}),
                             wts_packet(0x00, compressed), smaller}) {
    Receiver receiver(read_serial_profile("wts"));
    receiver.push(other);
    receiver.send({frame});
    receiver.push(other);
    receiver.send({frame});
    receiver.expect_exactly({frame, frame});
    EXPECT_EQ(receiver.garbage(), other == smaller ? 2 * smaller.size() : 0);
    EXPECT_EQ(receiver.checksum_errors(), 0u);
  }
}

TEST(Wts, TellsTheTimeOfTheBoard) {
  Receiver receiver(read_serial_profile("wts"));
  Bytes packet{0xaa, 0xaa, 0xaa, 0x00, 0xad, 0x00, 0x39, 0x30};  // 0x00003039 = 12345 ms
  packet.resize(6 + 5 + 168);
  packet.insert(packet.end(), {0xf1, 0x72});  // the checksum, by another program
  receiver.push(packet);
  EXPECT_DOUBLE_EQ(receiver.frames().at(0).device_time_s.value(), 12.345);
}

// The commands that start and stop the stream are packets, too.
TEST(Wts, CommandsCarryRightChecksums) {
  const SerialProfile profile = read_serial_profile("wts");
  EXPECT_EQ(profile.start, wts_packet(0x21, {0x00, 20, 0x00}));
  EXPECT_EQ(profile.stop, wts_packet(0x22, {}));
}

/// A FlexiTac frame of zeros except for these bytes of the payload.
Bytes flexitac(std::initializer_list<std::pair<std::size_t, std::uint8_t>> set) {
  Bytes bytes{0xaa, 0x55};
  bytes.resize(514);
  for (const auto& [at, value] : set) {
    bytes[2 + at] = value;
  }
  return bytes;
}

TEST(FlexiTac, IsNotMisledByMarkersInThePayload) {
  Receiver receiver(read_serial_profile("flexitac"));
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
  receiver.push(std::span(misleading).subspan(100));  // joins within a frame
  receiver.push(misleading);
  receiver.push(misleading);
  receiver.push(flexitac({}));
  for (const std::size_t at : {3, 4, 5}) {
    receiver.clear();
    receiver.push(flexitac({{at, 9}}));
  }
  ASSERT_FALSE(receiver.frames().empty());
  EXPECT_EQ(receiver.frames().back().values[5], 9.0);
}

TEST(AnySkin, PassesOnWhatIsNoNumber) {
  std::mt19937 random(6);
  const SentFrame frame = random_frame("anyskin", random);
  for (const Bytes& pattern : {Bytes{0x00, 0x00, 0x80, 0x7f}, Bytes{0x00, 0x00, 0x80, 0xff},
                               Bytes{0x01, 0x00, 0xc0, 0xff}}) {
    Bytes damaged = frame.bytes;
    constexpr std::size_t chip = 2;
    std::ranges::copy(pattern, damaged.begin() + chip * 16 + 12);
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

/// A packet of a TSF-85 that holds this content, and other bytes behind it.
Bytes tsf85_packet(Bytes content, const Bytes& rest = {}) {
  content.insert(content.end(), rest.begin(), rest.end());
  Bytes packet{0x9a, 0x00, 0x58, static_cast<std::uint8_t>(content.size())};
  packet.insert(packet.end(), content.begin(), content.end());
  return packet;
}

/// A packet of a finger whose taxels all read `value`, and of other bytes behind them.
Bytes finger(int index, std::uint8_t value, const Bytes& rest = {}) {
  Bytes content{static_cast<std::uint8_t>(0x10 | index << 2)};
  for (int i = 0; i < 28; ++i) {
    content.insert(content.end(), {0x00, value});
  }
  return tsf85_packet(content, rest);
}

/// A packet of the board's clock, and of other bytes behind it.
Bytes clock(std::uint64_t ticks, const Bytes& rest = {}) {
  Bytes content{0x70};
  for (int shift = 56; shift >= 0; shift -= 8) {
    content.push_back(static_cast<std::uint8_t>(ticks >> shift));
  }
  return tsf85_packet(content, rest);
}

struct FingersCase {
  const char* name;
  std::vector<Bytes> packets;
  std::vector<std::pair<double, double>> frames = {};  ///< what its two fingers read
  std::size_t garbage = 0;
};

TEST(Tsf85, PairsTheFingersOfOneFrame) {
  const std::vector<FingersCase> cases = {
      {.name = "one of a pair was lost",
       .packets = {finger(0, 1), finger(1, 2), finger(1, 4), finger(0, 5), finger(0, 7),
                   finger(1, 8)},
       .frames = {{1, 2}, {7, 8}}},
      {.name = "a byte too many comes between",
       .packets = {finger(0, 1), {0x00}, finger(1, 4), finger(0, 7), finger(1, 8)},
       .frames = {{7, 8}},
       .garbage = 1},
      {.name = "the payload holds the preamble",
       .packets = {finger(0, 0x9a), finger(1, 0x9a), finger(0, 0x9a), finger(1, 0x9a)},
       .frames = {{0x9a, 0x9a}, {0x9a, 0x9a}}},
      {.name = "an unknown tag behind what is known",
       .packets = {finger(0, 1, {0x80, 0x9a, 0x00}), finger(1, 2)},
       .frames = {{1, 2}}},
      {.name = "longer than any packet", .packets = {{0x9a, 0x00, 0x58, 61}}, .garbage = 4},
      {.name = "unknown tag", .packets = {tsf85_packet({0xf0, 1, 2})}, .garbage = 7},
      {.name = "cut short", .packets = {tsf85_packet({0x20, 1, 2, 0x30, 1})}, .garbage = 9},
      {.name = "another command", .packets = {{0x9a, 0x00, 0x57, 3, 0x20, 1, 2}}, .garbage = 7}};
  for (const FingersCase& fingers : cases) {
    SCOPED_TRACE(fingers.name);
    Receiver receiver(read_serial_profile("tsf85"));
    std::vector<std::pair<double, double>> expected = fingers.frames;
    std::ranges::for_each(fingers.packets, [&](const Bytes& packet) { receiver.push(packet); });
    for (const Bytes& packet : {finger(0, 1), finger(1, 2), finger(0, 3)}) {
      receiver.push(packet);
    }
    expected.emplace_back(1, 2);
    ASSERT_EQ(receiver.frames().size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(receiver.frames()[i].values.front(), expected[i].first);
      EXPECT_EQ(receiver.frames()[i].values.back(), expected[i].second);
    }
    EXPECT_EQ(receiver.garbage(), fingers.garbage);
  }
}

TEST(Tsf85, LaysTheTaxelsOutInSevenRowsOfFourFromTheTop) {
  const std::vector<glm::dvec2> elements = read_serial_profile("tsf85").elements_mm;
  for (int i = 0; i < 28; ++i) {
    EXPECT_NEAR(elements[i].x, 3.2 * (i % 4 - 1.5), 1e-12) << i;
    EXPECT_NEAR(elements[i].y, 3.2 * (3 - i / 4), 1e-12) << i;
    EXPECT_EQ(elements[28 + i], elements[i] + glm::dvec2(0.0, 100.0)) << i;
  }
}

TEST(Tsf85, TellsItsClockInTheUnitThatFitsTheRate) {
  // Frames at 100 Hz; the last time stamp is of a frame after one that was lost.
  for (const std::uint64_t unit : {1'000ULL, 1'000'000ULL, 1'000'000'000ULL}) {
    Receiver receiver(read_serial_profile("tsf85"));
    for (const double time_s : {5.0, 5.01, 5.03}) {
      // An unknown tag follows, which has no bearing on what comes before it.
      receiver.push(clock(static_cast<std::uint64_t>(std::llround(time_s * unit)), {0xf1, 1, 2}));
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
  packet.insert(packet.end(), {0x62, 0x69});  // the checksum, by another program
  receiver.push(packet);
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_DOUBLE_EQ(receiver.frames()[0].device_time_s.value(), 1.0);
  EXPECT_DOUBLE_EQ(receiver.frames()[0].values[12], 12.0);  // 20 * 12 = 240 fits a byte
}

}  // namespace palpate::board_protocol_test
