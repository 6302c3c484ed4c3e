// Feeds a million random and damaged packets to the driver's parsers: none may crash, read out of
// bounds (the sanitizers watch), or be out of step for longer than two frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "driver/serial_profile.hpp"
#include "driver/takktile_protocol.hpp"
#include "palpate/error.hpp"
#include "sent_frame.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::mutated_stream_test {

/// Damages bytes in one of the ways in which a line or a board may damage them.
void mutate(Bytes& bytes, std::mt19937& random) {
  const auto place = [&] { return static_cast<std::ptrdiff_t>(random() % (bytes.size() + 1)); };
  switch (random() % 6) {
    case 0:  // bits flip
      for (unsigned flips = 1 + random() % 8; flips > 0 && !bytes.empty(); --flips) {
        bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      }
      break;
    case 1:  // the end is lost
      bytes.resize(static_cast<std::size_t>(place()));
      break;
    case 2: {  // some in the middle are lost
      const auto [from, to] = std::minmax({place(), place()});
      bytes.erase(bytes.begin() + from, bytes.begin() + to);
      break;
    }
    case 3: {  // others come between
      const Bytes more = random_bytes(random() % 40, random);
      bytes.insert(bytes.begin() + place(), more.begin(), more.end());
      break;
    }
    case 4: {  // some come twice
      const auto [from, to] = std::minmax({place(), place()});
      const Bytes again(bytes.begin() + from, bytes.begin() + to);
      bytes.insert(bytes.begin() + to, again.begin(), again.end());
      break;
    }
    default:
      bytes = random_bytes(random() % 80, random);
  }
}

bool none_infinite(const ParsedFrame& frame) {
  return std::none_of(frame.values.begin(), frame.values.end(),
                      [](double value) { return std::isinf(value); });
}

class MutatedStream : public testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(MutatedStream, IsInStepAgainAfterTwoFrames) {
  const auto [board, packets] = GetParam();
  const SerialProfile profile = read_serial_profile(board);
  const std::unique_ptr<Deframer> deframer = make_deframer(profile);
  std::mt19937 random(20110509);
  std::vector<ParsedFrame> frames;
  // In pieces of any size, as transfers deliver them.
  const auto push = [&](std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
      const std::size_t piece = std::min<std::size_t>(bytes.size(), 1 + random() % 200);
      deframer->push(bytes.first(piece), frames);
      bytes = bytes.subspan(piece);
    }
  };
  // To make a frame takes longer than to parse it.
  std::vector<SentFrame> pool;
  for (int i = 0; i < 1000; ++i) {
    pool.push_back(random_frame(board, random));
  }
  int missed = 0;
  std::uint64_t bytes_sent = 0;
  constexpr std::size_t clean = 4;
  for (int packet = 0; packet < packets; packet += 1 + int{clean}) {
    const std::size_t first = random() % (pool.size() - clean);
    SentFrame damaged = pool[first];
    mutate(damaged.bytes, random);
    push(damaged.bytes);
    bytes_sent += damaged.bytes.size();
    frames.clear();
    const std::span sent = std::span(pool).subspan(first + 1, clean);
    for (const SentFrame& frame : sent) {
      push(frame.bytes);
      bytes_sent += frame.bytes.size();
    }
    for (const ParsedFrame& frame : frames) {
      ASSERT_EQ(frame.values.size(), profile.elements_mm.size());
      ASSERT_TRUE(none_infinite(frame));
    }
    // The third frame is decoded at the latest when the fourth has arrived.
    missed += std::none_of(frames.begin(), frames.end(), [&](const ParsedFrame& frame) {
      return frame.values == sent[2].values;
    });
  }
  EXPECT_LE(deframer->counters().garbage_bytes, bytes_sent);
  EXPECT_EQ(missed, 0);
}

INSTANTIATE_TEST_SUITE_P(Boards, MutatedStream,
                         testing::Values(std::pair{"tsf85", 150'000}, std::pair{"wts", 150'000},
                                         std::pair{"flexitac", 100'000},
                                         std::pair{"anyskin", 200'000}),
                         [](const auto& board) { return std::string(board.param.first); });

TEST(MutatedPackets, OfATakkTileNeverGiveAHalfFrame) {
  std::mt19937 random(59);
  constexpr std::size_t cells = 40;
  takktile::Deframer deframer(std::vector<takktile::Calibration>(
      cells, takktile::Calibration{.a0 = 2009.75, .b1 = -2.375, .b2 = -0.92, .c12 = 0.00079}));
  std::vector<ParsedFrame> frames;
  const Bytes frame = random_bytes(4 * cells, random);  // 64 + 64 + 32 bytes
  const auto push_frame = [&] {
    for (std::size_t at = 0; at < frame.size(); at += takktile::packet_bytes) {
      deframer.push(
          std::span(frame).subspan(at, std::min(takktile::packet_bytes, frame.size() - at)),
          frames);
    }
  };
  push_frame();
  ASSERT_EQ(frames.size(), 1u);
  const std::vector<double> expected = frames.front().values;
  for (int round = 0; round < 30'000; ++round) {
    for (unsigned foreign = random() % 4; foreign > 0; --foreign) {
      Bytes packet = random_bytes(takktile::packet_bytes, random);
      mutate(packet, random);
      deframer.push(packet, frames);
    }
    push_frame();
    push_frame();
    for (const ParsedFrame& any : frames) {
      ASSERT_EQ(any.values.size(), cells);
      ASSERT_TRUE(none_infinite(any));
    }
    frames.clear();
    push_frame();
    ASSERT_EQ(frames.size(), 1u);
    ASSERT_EQ(frames.front().values, expected);
    frames.clear();
  }
}

TEST(MutatedReplies, OfATakkTileAreUnderstoodOrRefused) {
  std::mt19937 random(60);
  int maps = 0;
  int calibrations = 0;
  for (int round = 0; round < 60'000; ++round) {
    Bytes reply(random() % 2 == 0 ? 8 : 40, random() % 2 == 0 ? 0x1f : 0xff);
    mutate(reply, random);
    try {
      const std::vector<takktile::Cell> cells = takktile::parse_alive_map(reply);
      ASSERT_FALSE(cells.empty());
      ASSERT_LE(cells.size(), 40u);
      ASSERT_EQ(takktile::element_positions(cells).size(), cells.size());
      ++maps;
    } catch (const Error& error) {
      ASSERT_EQ(error.fault(), Fault::system);
    }
    reply = random_bytes(8, random);
    if (random() % 2 == 0) {
      mutate(reply, random);
    }
    try {
      const takktile::Calibration calibration = takktile::parse_calibration(reply);
      ASSERT_TRUE(std::isfinite(takktile::pressure_kpa(calibration, 1023, 1023)));
      ++calibrations;
    } catch (const Error& error) {
      ASSERT_EQ(error.fault(), Fault::system);
    }
  }
  EXPECT_GT(maps, 1000);
  EXPECT_GT(calibrations, 1000);
}

// Lines of the shipped profiles, changed and put together at random.
TEST(MutatedProfile, IsReadOrRefusedInOneLine) {
  std::mt19937 random(61);
  const std::vector<std::string> boards = shipped_profiles();
  std::vector<std::string> texts;
  std::vector<std::string> lines;
  for (const std::string& name : boards) {
    texts.push_back(bytes_of(read_serial_profile(name).path));
    std::string kept;
    std::string line;
    for (const char c : texts.back()) {
      line += c;
      if (c == '\n') {
        if (!line.starts_with('#') && line != "\n") {
          lines.push_back(line);
          kept += line;
        }
        line.clear();
      }
    }
    texts.back() = kept;  // comments would only take time
  }
  const std::vector<std::string> words = {
      "0",  "-1",  "65536",  "1e308", ".nan",  "u16le",   "[",  "]",         "{",  "}",
      "*a", "&a ", "tag: 0", "aa",    "bytes", "most: 1", "? ", "!!binary ", "\t", "\xff"};
  int read = 0;
  for (int round = 0; round < 8'000; ++round) {
    std::string text = texts[random() % texts.size()];
    for (unsigned edits = random() % 4 == 0 ? 3 : 1; edits > 0; --edits) {
      const std::size_t at = random() % (text.size() + 1);
      switch (random() % 4) {
        case 0:
          text.insert(text.find('\n', at) == std::string::npos ? at : text.find('\n', at) + 1,
                      lines[random() % lines.size()]);
          break;
        case 1:
          text.erase(at, random() % 30);
          break;
        case 2:
          text.replace(at, std::min<std::size_t>(random() % 6, text.size() - at),
                       words[random() % words.size()]);
          break;
        default: {
          Bytes bytes(text.begin(), text.end());
          mutate(bytes, random);
          text.assign(bytes.begin(), bytes.end());
        }
      }
    }
    try {
      const SerialProfile profile = parse_serial_profile(text, "mutated.yaml");
      std::vector<ParsedFrame> frames;
      const std::unique_ptr<Deframer> deframer = make_deframer(profile);
      for (int i = 0; i < 4; ++i) {
        deframer->push(random_frame(boards[random() % boards.size()], random).bytes, frames);
      }
      for (const ParsedFrame& frame : frames) {
        ASSERT_EQ(frame.values.size(), profile.elements_mm.size());
      }
      ++read;
    } catch (const Error& error) {
      ASSERT_EQ(error.fault(), Fault::input);
      const std::string message = error.what();
      ASSERT_TRUE(message.starts_with("mutated.yaml: line ")) << message << "\n" << text;
      ASSERT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
  EXPECT_GT(read, 500) << "too few get as far as a deframer";
}

}  // namespace palpate::mutated_stream_test
