#pragma once

#include <optional>

#include "board.hpp"
#include "palpate/sensor.hpp"
#include "transfer_ring.hpp"
#include "usb_device.hpp"
#include "usb_handle.hpp"

namespace palpate {

/// A board that is open, claimed and asked for its calibration, and its stream while it runs.
class BoardLink {
 public:
  /// All of them have to outlive the link. @throws Error
  BoardLink(const UsbContext& context, Board& board, UsbDevice device,
            TransferRing::Counters& counters);

  const SensorDescription& description() const { return description_; }

  /// The stream runs from here on. @throws Error
  void begin();
  /// Asks the board to stop, takes what is still on its way, and takes the ring apart.
  std::vector<TransferRing::Completion> end();

  /// While the stream runs.
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
