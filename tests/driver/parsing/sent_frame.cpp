#include "sent_frame.hpp"

#include <algorithm>
#include <bit>
#include <map>

namespace palpate {

std::uint32_t checksum_of(const Checksum& checksum, const Bytes& bytes) {
  RunningChecksum running(checksum);
  running.push(Bytes{1, 2, 3});
  running.push(bytes);
  return running.of(3, 3 + bytes.size());
}

namespace {

void append(Bytes& bytes, const Bytes& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

SentFrame tsf85_frame(std::mt19937& random) {
  SentFrame frame;
  for (int finger = 0; finger < 2; ++finger) {
    const auto index = static_cast<int>(random() % 4);
    Bytes data{static_cast<std::uint8_t>(0x10 | finger << 2 | index)};
    for (int i = 0; i < 28; ++i) {
      const auto value = static_cast<std::uint16_t>(random());
      append(data, {static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)});
      frame.values.push_back(value);
    }
    append(frame.bytes, {0x9a, static_cast<std::uint8_t>(random()), 0x58,
                         static_cast<std::uint8_t>(data.size())});
    append(frame.bytes, data);
    // Acceleration comes now and then, in a packet of its own.
    if (random() % 2 == 0) {
      append(frame.bytes, {0x9a, 0x00, 0x58, 7, static_cast<std::uint8_t>(0x30 | finger << 2)});
      append(frame.bytes, random_bytes(6, random));
    }
  }
  return frame;
}

SentFrame wts_frame(std::mt19937& random) {
  SentFrame frame;
  Bytes payload = random_bytes(4, random);  // time
  payload.push_back(0);                     // not compressed
  for (int i = 0; i < 6 * 14; ++i) {
    const auto value = static_cast<std::uint16_t>(random() % 4096);
    append(payload, {static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8)});
    frame.values.push_back(value);
  }
  frame.bytes = wts_packet(0x00, payload);
  return frame;
}

template <std::size_t rows>
SentFrame flexitac_frame(std::mt19937& random) {
  SentFrame frame{.bytes = {0xaa, 0x55}, .values = {}};
  append(frame.bytes, random_bytes(rows * 32, random));
  frame.values.assign(frame.bytes.begin() + 2, frame.bytes.end());
  return frame;
}

SentFrame anyskin_frame(std::mt19937& random) {
  SentFrame frame;
  for (int chip = 0; chip < 5; ++chip) {
    for (int field = 0; field < 4; ++field) {
      const float value = static_cast<float>(random() % 20001) / 10.0f - 1000.0f;
      const auto pattern = std::bit_cast<std::uint32_t>(value);
      for (int byte = 0; byte < 4; ++byte) {
        frame.bytes.push_back(static_cast<std::uint8_t>(pattern >> (8 * byte)));
      }
      if (field == 3) {
        frame.values.push_back(double{value});
      }
    }
  }
  append(frame.bytes, {0x0d, 0x0a});
  return frame;
}

}  // namespace

SentFrame random_frame(const std::string& board, std::mt19937& random) {
  static const std::map<std::string, SentFrame (*)(std::mt19937&)> boards = {
      {"tsf85", tsf85_frame},
      {"wts", wts_frame},
      {"flexitac", flexitac_frame<16>},
      {"flexitac12", flexitac_frame<12>},
      {"anyskin", anyskin_frame}};
  return boards.at(board)(random);
}

std::vector<SentFrame> random_frames(const std::string& board, std::size_t count,
                                     std::mt19937& random) {
  std::vector<SentFrame> frames(count);
  std::ranges::generate(frames, [&] { return random_frame(board, random); });
  return frames;
}

Bytes wts_packet(std::uint8_t id, const Bytes& payload) {
  const std::size_t bytes = payload.size();
  Bytes packet(3, 0xaa);
  append(packet, {id, static_cast<std::uint8_t>(bytes), static_cast<std::uint8_t>(bytes >> 8)});
  append(packet, payload);
  const std::uint32_t crc = checksum_of(weiss, packet);
  append(packet, {static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8)});
  return packet;
}

Bytes random_bytes(std::size_t count, std::mt19937& random) {
  Bytes bytes(count);
  std::ranges::generate(bytes, [&] { return static_cast<std::uint8_t>(random()); });
  return bytes;
}

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
    case Damage::some_lost:
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
    }
  }
}

Bytes stream_of(const std::vector<SentFrame>& frames) {
  Bytes bytes;
  for (const SentFrame& frame : frames) {
    append(bytes, frame.bytes);
  }
  return bytes;
}

}  // namespace palpate
