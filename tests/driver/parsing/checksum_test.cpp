#include "driver/packet_format.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string_view>
#include <vector>

namespace palpate::checksum_test {

using Kind = Checksum::Kind;

std::uint32_t of(const Checksum::Parameters& parameters, std::string_view text) {
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  return Checksum(parameters)(bytes);
}

// The values named "check", over "123456789", of the catalogue of parametrised CRC algorithms.
TEST(Checksum, GivesTheCatalogueValues) {
  constexpr std::string_view check = "123456789";
  EXPECT_EQ(of({.bytes = 1, .polynomial = 0x07}, check), 0xf4u) << "CRC-8/SMBUS";
  EXPECT_EQ(of({.bytes = 1, .polynomial = 0x31, .reflect = true}, check), 0xa1u) << "CRC-8/MAXIM";
  EXPECT_EQ(of({.bytes = 2, .polynomial = 0x1021, .init = 0xffff}, check), 0x29b1u)
      << "CRC-16/CCITT-FALSE";
  EXPECT_EQ(of({.bytes = 2, .polynomial = 0x1021}, check), 0x31c3u) << "CRC-16/XMODEM";
  EXPECT_EQ(of({.bytes = 2, .polynomial = 0x8005, .init = 0xffff, .reflect = true}, check), 0x4b37u)
      << "CRC-16/MODBUS";
  // An asymmetric initial value shows whether it is reflected with the register.
  EXPECT_EQ(of({.bytes = 2, .polynomial = 0x1021, .init = 0xb2aa, .reflect = true}, check), 0x63d0u)
      << "CRC-16/RIELLO";
  EXPECT_EQ(of({.bytes = 4,
                .polynomial = 0x04c11db7,
                .init = 0xffffffff,
                .xor_out = 0xffffffff,
                .reflect = true},
               check),
            0xcbf43926u)
      << "CRC-32/ISO-HDLC";
  EXPECT_EQ(
      of({.bytes = 4, .polynomial = 0x04c11db7, .init = 0xffffffff, .xor_out = 0xffffffff}, check),
      0xfc891918u)
      << "CRC-32/BZIP2";
}

// The packets that the vendor's command set prints as examples; the CRC is sent low byte first.
TEST(Checksum, AgreesWithWeissRoboticsExamples) {
  const auto weiss = [](std::string_view bytes) {
    return of({.kind = Kind::weiss, .bytes = 2}, bytes);
  };
  EXPECT_EQ(weiss({"\xaa\xaa\xaa\x01\x02\x00\x12\x34", 8}), 0x666du);
  EXPECT_EQ(weiss({"\xaa\xaa\xaa\x01\x00\x00", 6}), 0x10e8u);
  EXPECT_EQ(weiss({"\xaa\xaa\xaa\x06\x00\x00", 6}), 0x2697u);
  // The checksum differs from the CRC-16 whose table it uses.
  EXPECT_NE(of({.bytes = 2, .polynomial = 0x1021, .init = 0xffff}, {"\xaa\xaa\xaa\x01\x00\x00", 6}),
            0x10e8u);
}

TEST(Checksum, AddsAndExors) {
  constexpr std::string_view bytes = "\xff\x02\x10";  // 255 + 2 + 16 = 273 = 0x111
  EXPECT_EQ(of({.kind = Kind::sum, .bytes = 1}, bytes), 0x11u);
  EXPECT_EQ(of({.kind = Kind::sum, .bytes = 2}, bytes), 0x111u);
  EXPECT_EQ(of({.kind = Kind::sum, .bytes = 1, .xor_out = 0xff}, bytes), 0xeeu);
  EXPECT_EQ(of({.kind = Kind::exor, .bytes = 1}, bytes), 0xedu);
  EXPECT_EQ(of({.kind = Kind::exor, .bytes = 1, .init = 0x0f}, bytes), 0xe2u);
}

TEST(Checksum, OfAStretchNeedsOnlyTheRunningValuesAtItsEnds) {
  std::mt19937 random(20261122);
  std::vector<std::uint8_t> stream(2000);
  for (std::uint8_t& byte : stream) {
    byte = static_cast<std::uint8_t>(random());
  }
  for (const Checksum::Parameters& parameters : std::vector<Checksum::Parameters>{
           {.kind = Kind::sum, .bytes = 1, .init = 0x31, .xor_out = 0xff},
           {.kind = Kind::sum, .bytes = 2},
           {.kind = Kind::exor, .bytes = 1, .init = 0x0f},
           {.kind = Kind::weiss, .bytes = 2},
           {.bytes = 1, .polynomial = 0x07, .init = 0x5a},
           {.bytes = 2, .polynomial = 0x1021, .init = 0xb2aa, .reflect = true},
           {.bytes = 2, .polynomial = 0x8005, .init = 0xffff, .xor_out = 0x1234},
           {.bytes = 4, .polynomial = 0x04c11db7, .init = 0xffffffff, .xor_out = 0xffffffff},
           {.bytes = 4, .polynomial = 0x04c11db7, .init = 0xffffffff, .reflect = true}}) {
    const Checksum checksum(parameters);
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
  const Checksum crc({.bytes = 4, .polynomial = 0x04c11db7, .init = 0xffffffff});
  const std::vector<std::uint8_t> stream(Checksum::longest_stretch, 0x5a);
  std::uint32_t running = 0;
  for (const std::uint8_t byte : stream) {
    running = crc.run_on(running, byte);
  }
  EXPECT_EQ(crc.of_stretch(0, running, stream.size()), crc(stream));
}

TEST(Checksum, OfNothingIsItsBeginning) {
  EXPECT_EQ(of({.bytes = 2, .polynomial = 0x1021, .init = 0xffff}, ""), 0xffffu);
  EXPECT_EQ(of({.kind = Kind::sum, .bytes = 1}, ""), 0u);
}

}  // namespace palpate::checksum_test
