// Feeds random and damaged packets to the driver's parsers: none may crash, read out of bounds (the
// sanitizers watch), or be out of step for longer than two frames.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "driver/serial_profile.hpp"
#include "driver/takktile_protocol.hpp"
#include "receiver.hpp"
#include "sent_frame.hpp"
#include "support/scratch_folder.hpp"
#include "support/trials.hpp"

namespace palpate::mutated_stream_test {

enum class Damage { bits_flip, end_lost, middle_lost, others_between, some_twice, all_random };
constexpr int kinds_of_damage = 6;

/// Damages bytes as a line or a board may damage them.
void damage(Bytes& bytes, Damage kind, std::mt19937& random) {
  const auto place = [&] {
    return bytes.begin() + static_cast<std::ptrdiff_t>(random() % (bytes.size() + 1));
  };
  const auto [from, to] = std::minmax({place(), place()});
  switch (kind) {
    case Damage::bits_flip:
      for (unsigned flips = 1 + random() % 8; flips > 0 && !bytes.empty(); --flips) {
        bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      }
      break;
    case Damage::end_lost:
      bytes.erase(from, bytes.end());
      break;
    case Damage::middle_lost:
      bytes.erase(from, to);
      break;
    case Damage::others_between: {
      const Bytes more = random_bytes(random() % 70, random);
      bytes.insert(from, more.begin(), more.end());
      break;
    }
    case Damage::some_twice: {
      const Bytes again(from, to);
      bytes.insert(to, again.begin(), again.end());
      break;
    }
    case Damage::all_random:
      bytes = random_bytes(random() % 80, random);
  }
}

/// Expects frames of as many elements, none of which reads infinity.
void expect_sound(const std::vector<ParsedFrame>& frames, std::size_t elements) {
  for (const ParsedFrame& frame : frames) {
    ASSERT_EQ(frame.values.size(), elements);
    ASSERT_TRUE(std::ranges::none_of(frame.values, [](double v) { return std::isinf(v); }));
  }
}

class MutatedStream : public testing::TestWithParam<const char*> {};

TEST_P(MutatedStream, IsInStepAgainAfterTwoFrames) {
  const std::string board = GetParam();
  const SerialProfile profile = read_serial_profile(board);
  Receiver receiver(profile);
  std::mt19937 random(20110509);
  // To make a frame takes longer than to parse it.
  const std::vector<SentFrame> pool = random_frames(board, 300, random);
  for (int trial = 0; trial < trials(1500); ++trial) {
    const auto first = pool.begin() + static_cast<std::ptrdiff_t>(random() % (pool.size() - 8));
    const std::vector<SentFrame> sent(first, first + 8);
    std::vector<SentFrame> damaged = sent;
    const bool between_frames = trial % (kinds_of_damage + 1) == kinds_of_damage;
    const Bytes garbage = random_bytes(between_frames ? 1 + random() % 300 : 0, random);
    if (between_frames) {
      damaged[3].bytes.insert(damaged[3].bytes.begin(), garbage.begin(), garbage.end());
    } else {
      damage(damaged[3].bytes, static_cast<Damage>(trial % (kinds_of_damage + 1)), random);
    }
    receiver.clear();
    const std::uint64_t garbage_before = receiver.garbage();
    const Bytes stream = stream_of(damaged);
    receiver.push_in_pieces(stream, [&] { return 1 + random() % 200; });
    SCOPED_TRACE(trial);
    expect_sound(receiver.frames(), profile.elements_mm.size());
    ASSERT_TRUE(receiver.has(sent, 0, 3));
    ASSERT_TRUE(receiver.has(sent, 5, 8));
    // Without a checksum, the damaged frame and one more may have wrong values.
    ASSERT_LE(receiver.strangers(sent), between_frames || board == "wts" ? 0 : 2);
    ASSERT_GE(receiver.garbage() - garbage_before, garbage.size());
    ASSERT_LE(receiver.garbage() - garbage_before, stream.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Boards, MutatedStream,
                         testing::Values("tsf85", "wts", "flexitac", "flexitac12", "anyskin"),
                         [](const auto& board) { return std::string(board.param); });

TEST(MutatedPackets, OfATakkTileNeverGiveAHalfFrame) {
  std::mt19937 random(59);
  for (const std::size_t cells : {1, 16, 40}) {
    SCOPED_TRACE(cells);
    takktile::Deframer deframer(std::vector<takktile::Calibration>(
        cells, takktile::Calibration{.a0 = 2009.75, .b1 = -2.375, .b2 = -0.92, .c12 = 0.00079}));
    std::vector<ParsedFrame> frames;
    std::uint64_t pushed = 0;
    std::uint64_t framed = 0;
    const auto push = [&](std::span<const std::uint8_t> packet) {
      const std::size_t before = frames.size();
      deframer.push(packet, frames);
      pushed += packet.size();
      framed += (frames.size() - before) * 4 * cells;
    };
    const Bytes frame = random_bytes(4 * cells, random);
    const auto push_frame = [&] {
      std::span<const std::uint8_t> rest = frame;
      for (; rest.size() >= takktile::packet_bytes; rest = rest.subspan(takktile::packet_bytes)) {
        push(rest.first(takktile::packet_bytes));
      }
      push(rest);
    };
    push_frame();
    ASSERT_EQ(frames.size(), 1u);
    const std::vector<double> expected = frames.front().values;
    for (int trial = 0; trial < trials(1000); ++trial) {
      for (unsigned foreign = random() % 4; foreign > 0; --foreign) {
        Bytes packet = random_bytes(takktile::packet_bytes, random);
        damage(packet, static_cast<Damage>(random() % kinds_of_damage), random);
        push(packet);
      }
      push_frame();
      push_frame();
      expect_sound(frames, cells);
      frames.clear();
      push_frame();
      ASSERT_EQ(frames.size(), 1u);
      ASSERT_EQ(frames.front().values, expected);
      ASSERT_EQ(deframer.counters().garbage_bytes + framed, pushed) << "each byte is of one";
    }
    EXPECT_EQ(deframer.counters().checksum_errors, 0u);
  }
}

// Lines of the shipped profiles, changed and put together at random.
TEST(MutatedProfile, IsReadOrRefusedInOneLine) {
  std::mt19937 random(61);
  const std::vector<std::string> boards = shipped_profiles();
  std::vector<std::string> texts;
  std::vector<std::string> lines;
  for (const std::string& name : boards) {
    std::istringstream file(bytes_of(read_serial_profile(name).path));
    texts.emplace_back();
    for (std::string line; std::getline(file, line);) {
      if (!line.starts_with('#') && !line.empty()) {  // comments would only take time
        lines.push_back(line + "\n");
        texts.back() += lines.back();
      }
    }
  }
  const std::vector<std::string> words = {
      "0",  "-1",  "65536",  "1e308", ".nan",  "u16le",   "[",  "]",         "{",  "}",
      "*a", "&a ", "tag: 0", "aa",    "bytes", "most: 1", "? ", "!!binary ", "\t", "\xff"};
  int read = 0;
  for (int trial = 0; trial < trials(2000); ++trial) {
    std::string text = texts[random() % texts.size()];
    for (unsigned edits = random() % 4 == 0 ? 3 : 1; edits > 0; --edits) {
      const std::size_t at = random() % (text.size() + 1);
      const std::size_t next_line = text.find('\n', at);
      switch (random() % 3) {
        case 0:
          text.insert(next_line == std::string::npos ? at : next_line + 1,
                      lines[random() % lines.size()]);
          break;
        case 1:
          text.erase(at, random() % 30);
          break;
        default:
          text.replace(at, random() % 6, words[random() % words.size()]);
      }
    }
    try {
      const SerialProfile profile = parse_serial_profile(text, "mutated.yaml");
      Receiver receiver(profile);
      for (int i = 0; i < 4; ++i) {
        receiver.send({random_frame(boards[random() % boards.size()], random)});
      }
      expect_sound(receiver.frames(), profile.elements_mm.size());
      ++read;
    } catch (const Error& error) {
      ASSERT_EQ(error.fault(), Fault::input);
      const std::string message = error.what();
      ASSERT_TRUE(message.starts_with("mutated.yaml: line ")) << message << "\n" << text;
      ASSERT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
  EXPECT_GT(read, trials(2000) / 16) << "too few get as far as a deframer";
}

}  // namespace palpate::mutated_stream_test
