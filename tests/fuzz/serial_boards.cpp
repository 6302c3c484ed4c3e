// The first byte chooses a shipped board, or a profile whose text follows, up to a zero byte; the
// next byte the pieces in which the board's stream comes, which is the rest.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "driver/deframer.hpp"
#include "driver/serial_profile.hpp"
#include "palpate/error.hpp"

namespace {

void expect(bool holds) {
  if (!holds) {
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<palpate::SerialProfile> boards = [] {
    std::vector<palpate::SerialProfile> read;
    for (const std::string& name : palpate::shipped_profiles()) {
      read.push_back(palpate::read_serial_profile(name));
    }
    return read;
  }();
  expect(!boards.empty());
  std::span<const std::uint8_t> rest(data, size);
  if (rest.empty()) {
    return 0;
  }
  const std::size_t board = rest[0] % (boards.size() + 1);
  rest = rest.subspan(1);
  palpate::SerialProfile profile;
  if (board < boards.size()) {
    profile = boards[board];
  } else {
    const auto end = std::find(rest.begin(), rest.end(), 0);
    const std::string text(rest.begin(), end);
    rest = rest.subspan(text.size());
    try {
      profile = palpate::parse_serial_profile(text, "fuzz.yaml");
    } catch (const palpate::Error&) {
      return 0;
    }
  }
  const std::size_t piece = (rest.empty() ? 0 : rest[0]) + std::size_t{1};
  palpate::PacketDeframer deframer(profile.packet);
  std::vector<palpate::Frame> frames;
  for (; !rest.empty(); rest = rest.subspan(std::min(piece, rest.size()))) {
    deframer.push(rest.first(std::min(piece, rest.size())), frames);
  }
  for (const palpate::Frame& frame : frames) {
    expect(frame.values.size() == profile.elements_mm.size());
    expect(std::ranges::none_of(frame.values, [](double value) { return std::isinf(value); }));
  }
  expect(deframer.counters().garbage_bytes <= size);
  return 0;
}
