// A profile's text, up to a zero byte, and what its deframer is to make of the bytes behind it.
#include "driver/serial_profile.hpp"

#include <algorithm>
#include <cstdlib>

#include "palpate/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> input(data, size);
  const auto end = std::find(input.begin(), input.end(), 0);
  const auto text_bytes = static_cast<std::size_t>(end - input.begin());
  try {
    const palpate::SerialProfile profile =
        palpate::parse_serial_profile(std::string(input.begin(), end), "fuzz.yaml");
    std::vector<palpate::ParsedFrame> frames;
    palpate::make_deframer(profile)->push(input.subspan(text_bytes), frames);
    for (const palpate::ParsedFrame& frame : frames) {
      if (frame.values.size() != profile.elements_mm.size()) {
        std::abort();
      }
    }
  } catch (const palpate::Error&) {
  }
  return 0;
}
