// Tests the work per byte on streams that look like a packet's beginning at every byte, with
// profiles of the largest packets. They take milliseconds; reading a packet per byte takes minutes.
#include <gtest/gtest.h>

#include <string>

#include "driver/packet_format.hpp"
#include "driver/serial_profile.hpp"
#include "driver/without_memory.hpp"
#include "receiver.hpp"

namespace palpate::deframer_work_test {

constexpr const char* largest = R"(
name: largest
elements: [{grid: [128, 128], pitch_mm: [1, 1]}]
packet:
  - bytes: "00"
  - {values: u8, stride: 3}
)";

class LargestPacket : public testing::TestWithParam<const char*> {};

TEST_P(LargestPacket, IsFoundBehindManyThatBeginLikeIt) {
  const std::string check = GetParam();
  const SerialProfile profile =
      parse_serial_profile(largest + ("  - {" + check + "}\n"), "largest.yaml");
  const auto& checksum = std::get<PacketFormat::Check>(profile.packet.fields.back()).checksum;
  Bytes packet(1 + 3 * 16384, 0);
  for (std::size_t i = 1; i < packet.size(); ++i) {
    packet[i] = static_cast<std::uint8_t>(i / 3);
  }
  const std::uint32_t sum = checksum(packet);
  for (std::size_t i = 0; i < checksum.bytes(); ++i) {
    packet.push_back(static_cast<std::uint8_t>(sum >> (8 * i)));
  }
  Receiver receiver(profile);
  Bytes noise(1'000'000, 0);
  noise[0] = 1;  // out of step from here on
  receiver.push(noise);
  receiver.push_in_pieces(packet, [] { return 7; });  // as a board of short packets delivers it
  ASSERT_EQ(receiver.frames().size(), 1u);
  EXPECT_EQ(receiver.frames()[0].values.back(), packet[1 + 3 * 16383]);
  EXPECT_EQ(receiver.garbage(), noise.size());
}

// Each of these checksums is wrong for a packet of zeros.
INSTANTIATE_TEST_SUITE_P(
    Checksums, LargestPacket,
    testing::Values("checksum: sum16, init: 0x1234", "checksum: weiss16",
                    "checksum: xor8, init: 0x11",
                    "checksum: crc32, polynomial: 0x04c11db7, init: 0xffffffff"));

TEST(LargestParts, AreGoneThroughInBoundedWork) {
  // Each byte begins a packet of 2570 bytes, whose last part is cut short.
  Receiver receiver(parse_serial_profile(R"(
name: parts
elements: [[0, 0], [1, 0], [2, 0]]
packet:
  - bytes: "0a"
  - {length: u16be, most: 4096}
  - {parts: u8, tags: [{tag: 0x0a, values: 3}]}
)",
                                         "parts.yaml"));
  receiver.push(Bytes(50'000, 0x0a));
  EXPECT_TRUE(receiver.frames().empty());
  EXPECT_GT(receiver.garbage(), 45'000u);
}

TEST(EndlessGarbage, NeedsNoMoreMemoryThanItsFirstBytes) {
  const std::unique_ptr<Deframer> deframer = make_deframer(read_serial_profile("wts"));
  std::vector<ParsedFrame> frames;
  const Bytes piece(64, 0x00);
  constexpr int pieces = 1000;
  deframer->push(piece, frames);
  deframer->push(piece, frames);
  {
    const WithoutMemory none;
    for (int i = 2; i < pieces; ++i) {
      deframer->push(piece, frames);
    }
  }
  EXPECT_EQ(deframer->counters().garbage_bytes, pieces * piece.size());
}

}  // namespace palpate::deframer_work_test
