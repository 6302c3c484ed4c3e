#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "driver/takktile_protocol.hpp"
#include "driver/transfer_ring.hpp"
#include "driver/usb_device.hpp"
#include "palpate/sensor.hpp"

namespace palpate::takktile {

/// What a board tells of itself, before its interface is claimed.
struct Setup {
  SensorDescription description;
  std::vector<Calibration> calibrations;  ///< [e]
};
/// @throws Error
Setup read_setup(UsbHandle& handle);

/// A TakkTile whose interface is claimed and whose calibration is read: barometers under rubber, in
/// strips of five, which answer USB vendor requests. Between begin() and end() the link holds the
/// board's stream. Use it from one thread.
class Link {
 public:
  /// The context and the counters must outlive the link. @throws Error
  Link(const UsbContext& context, const ListedDevice& device, TransferRing::Counters& counters);

  const SensorDescription& description() const { return setup_.description; }

  /// Starts the stream. @throws Error
  void begin();
  /// Ends the stream and frees the ring. Returns the transfers not yet taken from the ring.
  std::vector<TransferRing::Completion> end();

  /// The ring of the running stream.
  TransferRing& ring() { return *ring_; }
  Deframer& deframer() { return deframer_; }

  /// Passes the bytes of a transfer to the deframer and appends the frames that they complete.
  /// @return the number of frames known to be spoiled
  std::uint64_t parse(const TransferRing::Completion& completion, std::vector<ParsedFrame>& frames);

 private:
  const UsbContext& context_;
  TransferRing::Counters& counters_;
  UsbHandle handle_;
  VendorInterface stream_;
  Setup setup_;
  Deframer deframer_;
  std::optional<TransferRing> ring_;
};

}  // namespace palpate::takktile
