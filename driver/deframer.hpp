#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// One frame decoded from a board's bytes.
struct ParsedFrame {
  std::vector<double> values;  ///< [e] in the board's pressure unit; NaN for a non-finite reading
  std::optional<double> device_time_s = {};  ///< by the board's clock, if the board sends a time
};

/// What a deframer dropped.
struct DeframerCounters {
  std::uint64_t checksum_errors = 0;  ///< packets with a wrong checksum
  std::uint64_t garbage_bytes = 0;    ///< bytes that belong to no packet
};

/// Decodes the byte stream of one board into frames. Accepts any bytes and does no I/O.
class Deframer {
 public:
  virtual ~Deframer() = default;

  /// Takes the next bytes of the stream, in pieces of any size, and appends the frames that they
  /// complete. A board whose frames end with a short packet needs one USB packet per call.
  virtual void push(std::span<const std::uint8_t> bytes, std::vector<ParsedFrame>& frames) = 0;

  /// Forgets a partly received frame. Call it after lost bytes and before a new start.
  virtual void reset() = 0;

  virtual const DeframerCounters& counters() const = 0;
};

}  // namespace palpate
