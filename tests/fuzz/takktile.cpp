// Replies of a TakkTile board, and packets of any length: a length byte, then as many bytes.
#include "driver/takktile_protocol.hpp"

#include <algorithm>
#include <cstdlib>

#include "palpate/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> input(data, size);
  std::size_t cells = 1 + size % 40;
  try {
    cells = palpate::takktile::parse_alive_map(input.first(std::min<std::size_t>(size, 40))).size();
  } catch (const palpate::Error&) {
  }
  palpate::takktile::Calibration calibration{.b1 = 1.0};
  try {
    calibration = palpate::takktile::parse_calibration(input.first(std::min<std::size_t>(size, 8)));
  } catch (const palpate::Error&) {
  }
  std::uint64_t garbage_bytes = 0;
  palpate::takktile::Deframer deframer(
      std::vector<palpate::takktile::Calibration>(cells, calibration), garbage_bytes);
  for (std::span<const std::uint8_t> rest = input; !rest.empty();) {
    const std::size_t bytes = std::min<std::size_t>(rest[0] % 80, rest.size() - 1);
    const auto frame =
        deframer.push(rest.subspan(1, bytes), bytes < palpate::takktile::packet_bytes);
    if ((frame && frame->values.size() != cells) || garbage_bytes > size) {
      std::abort();
    }
    rest = rest.subspan(1 + bytes);
  }
  return 0;
}
