#include "driver/packet_format.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string_view>
#include <vector>

#include "sent_frame.hpp"

namespace palpate::checksum_test {

using Kind = Checksum::Kind;
using Parameters = Checksum::Parameters;

Parameters crc(std::size_t bytes, std::uint32_t polynomial, std::uint32_t init = 0,
               std::uint32_t xor_out = 0, bool reflect = false) {
  return {.bytes = bytes,
          .polynomial = polynomial,
          .init = init,
          .xor_out = xor_out,
          .reflect = reflect};
}

struct ChecksumCase {
  const char* name;
  std::uint32_t expected;
  std::string_view bytes;
  Parameters parameters;
};

constexpr std::string_view check = "123456789";
constexpr std::string_view three = "\xff\x02\x10";  // 255 + 2 + 16 = 273 = 0x111

// The values named "check", over "123456789", are those of the catalogue of parametrised CRC
// algorithms; those of Weiss Robotics, of packets that its command set prints as examples.
const ChecksumCase cases[] = {
    {"CRC-8/SMBUS", 0xf4, check, crc(1, 0x07)},
    {"CRC-8/MAXIM", 0xa1, check, crc(1, 0x31, 0, 0, true)},
    {"CRC-16/CCITT-FALSE", 0x29b1, check, crc(2, 0x1021, 0xffff)},
    {"CRC-16/XMODEM", 0x31c3, check, crc(2, 0x1021)},
    {"CRC-16/MODBUS", 0x4b37, check, crc(2, 0x8005, 0xffff, 0, true)},
    // An asymmetric initial value shows whether it is reflected with the register.
    {"CRC-16/RIELLO", 0x63d0, check, crc(2, 0x1021, 0xb2aa, 0, true)},
    {"CRC-32/ISO-HDLC", 0xcbf43926, check, crc(4, 0x04c11db7, 0xffffffff, 0xffffffff, true)},
    {"CRC-32/BZIP2", 0xfc891918, check, crc(4, 0x04c11db7, 0xffffffff, 0xffffffff)},
    {"Weiss 1", 0x10e8, {"\xaa\xaa\xaa\x01\x00\x00", 6}, {.kind = Kind::weiss, .bytes = 2}},
    {"Weiss 6", 0x2697, {"\xaa\xaa\xaa\x06\x00\x00", 6}, {.kind = Kind::weiss, .bytes = 2}},
    {"8-bit sum", 0x11, three, {.kind = Kind::sum, .bytes = 1}},
    {"16-bit sum", 0x111, three, {.kind = Kind::sum, .bytes = 2}},
    {"sum of all", 0xbd, three, {.kind = Kind::sum, .bytes = 1, .init = 0x31, .xor_out = 0xff}},
    {"exclusive or", 0xed, three, {.kind = Kind::exor, .bytes = 1}},
    {"begun", 0xe2, three, {.kind = Kind::exor, .bytes = 1, .init = 0x0f}},
    {"CRC of nothing", 0xffff, "", crc(2, 0x1021, 0xffff)},
    {"sum of nothing", 0, "", {.kind = Kind::sum, .bytes = 1}}};

TEST(Checksum, GivesThePublishedValues) {
  for (const ChecksumCase& row : cases) {
    const Bytes bytes(row.bytes.begin(), row.bytes.end());
    EXPECT_EQ(Checksum(row.parameters)(bytes), row.expected) << row.name;
  }
}

TEST(Checksum, OfAStretchNeedsOnlyTheRunningValuesAtItsEnds) {
  std::mt19937 random(20261122);
  const Bytes stream = random_bytes(2000, random);
  for (const ChecksumCase& row : cases) {
    SCOPED_TRACE(row.name);
    const Checksum checksum(row.parameters);
    std::vector<std::uint32_t> running{static_cast<std::uint32_t>(random() & 0xff)};
    for (const std::uint8_t byte : stream) {
      running.push_back(checksum.run_on(running.back(), byte));
    }
    for (int i = 0; i < 200; ++i) {
      const auto [from, to] = std::minmax({random() % 2001, random() % 2001});
      ASSERT_EQ(checksum.of_stretch(running[from], running[to], to - from),
                checksum(std::span(stream).subspan(from, to - from)))
          << from << " to " << to;
    }
  }
}

TEST(Checksum, OfTheLongestStretch) {
  const Checksum checksum(crc(4, 0x04c11db7, 0xffffffff));
  const Bytes stream(Checksum::longest_stretch, 0x5a);
  std::uint32_t running = 0;
  for (const std::uint8_t byte : stream) {
    running = checksum.run_on(running, byte);
  }
  EXPECT_EQ(checksum.of_stretch(0, running, stream.size()), checksum(stream));
}

}  // namespace palpate::checksum_test
