// The first byte chooses a shipped board, the second the pieces in which its stream comes.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "driver/serial_profile.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<palpate::SerialProfile> profiles = [] {
    std::vector<palpate::SerialProfile> read;
    for (const std::string& name : palpate::shipped_profiles()) {
      read.push_back(palpate::read_serial_profile(name));
    }
    if (read.empty()) {
      std::abort();
    }
    return read;
  }();
  if (size < 2) {
    return 0;
  }
  const palpate::SerialProfile& profile = profiles[data[0] % profiles.size()];
  const std::size_t piece = data[1] + std::size_t{1};
  const auto deframer = palpate::make_deframer(profile);
  std::vector<palpate::ParsedFrame> frames;
  for (std::span<const std::uint8_t> rest(data + 2, size - 2); !rest.empty();) {
    const std::size_t bytes = std::min(piece, rest.size());
    deframer->push(rest.first(bytes), frames);
    rest = rest.subspan(bytes);
  }
  for (const palpate::ParsedFrame& frame : frames) {
    if (frame.values.size() != profile.elements_mm.size() ||
        !std::all_of(frame.values.begin(), frame.values.end(),
                     [](double value) { return std::isfinite(value); })) {
      std::abort();
    }
  }
  return deframer->counters().garbage_bytes <= size ? 0 : (std::abort(), 0);
}
