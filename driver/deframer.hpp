#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// One frame as the bytes of a board give it.
struct ParsedFrame {
  std::vector<double> values;  ///< [e] in the board's pressure unit; NaN where it sent no number
  std::optional<double> device_time_s = {};  ///< by the board's clock, where it sends one
};

/// What a deframer met that was no frame.
struct DeframerCounters {
  std::uint64_t checksum_errors = 0;  ///< packets dropped for that
  std::uint64_t garbage_bytes = 0;    ///< bytes that belong to no packet
};

/// Turns the bytes of one board into frames, whatever the bytes are: pure, incremental, no I/O.
class Deframer {
 public:
  virtual ~Deframer() = default;

  /// Takes what one USB transfer delivered, at any split of the stream (boards whose frames end
  /// with a short packet get whole packets), and appends the frames that are complete.
  virtual void push(std::span<const std::uint8_t> bytes, std::vector<ParsedFrame>& frames) = 0;

  /// Forgets a frame in parts: after a loss, or before a new start.
  virtual void reset() = 0;

  virtual const DeframerCounters& counters() const = 0;
};

}  // namespace palpate
