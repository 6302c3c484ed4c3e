#pragma once

#include <optional>

#include "driver/board.hpp"
#include "driver/transfer_ring.hpp"
#include "driver/usb_device.hpp"
#include "driver/usb_handle.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// An open board: its interfaces are claimed, its calibration is read. Between begin() and end()
/// the link holds the board's stream.
class BoardLink {
 public:
  /// The references must outlive the link. @throws Error
  BoardLink(const UsbContext& context, Board& board, UsbDevice device,
            TransferRing::Counters& counters);

  const SensorDescription& description() const { return description_; }

  /// Starts the stream. @throws Error
  void begin();
  /// Ends the stream and frees the ring. Returns the transfers not yet taken from the ring.
  std::vector<TransferRing::Completion> end();

  /// The ring of the running stream.
  TransferRing& ring() { return *ring_; }

 private:
  const UsbContext& context_;
  Board& board_;
  TransferRing::Counters& counters_;
  UsbHandle handle_;
  StreamSource source_;
  SensorDescription description_;
  std::optional<TransferRing> ring_;
};

}  // namespace palpate
