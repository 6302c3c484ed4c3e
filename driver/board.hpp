#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "deframer.hpp"
#include "palpate/sensor.hpp"
#include "transfer_ring.hpp"
#include "usb_handle.hpp"

namespace palpate {

/// Where a board's stream comes from.
struct StreamSource {
  std::vector<int> interfaces;  ///< to be claimed, in this order
  std::uint8_t endpoint = 0;    ///< bulk, towards the host
  std::size_t transfer_bytes = 0;
};

/// What one kind of board has beyond the transport: its requests and its bytes. Used from one
/// thread at a time; all that talks to the device throws Error.
class Board {
 public:
  virtual ~Board() = default;

  /// What users call it, such as "takktile".
  virtual const std::string& name() const = 0;
  /// Its USB ids are known. False: only the user knows which device it is.
  virtual bool has_ids() const { return true; }
  /// The device bears one of its ids.
  virtual bool fits(const UsbDevice& device) const = 0;
  /// From the descriptors alone.
  virtual StreamSource source(const UsbDevice& device) const = 0;

  /// Reads what the board says of itself, its calibration too, and makes the deframer anew. Nothing
  /// has to be claimed. The description's serial is left to the caller.
  virtual SensorDescription configure(UsbHandle& handle) = 0;
  /// Frames come from here on; the interfaces are claimed.
  virtual void start(UsbHandle& handle) = 0;
  virtual void stop(UsbHandle& handle) = 0;

  /// Of the last configure().
  virtual Deframer& deframer() = 0;
  /// Gives the deframer what a transfer brought, in the pieces that it wants, and appends the
  /// frames that are complete. Returns how many are known to be spoiled.
  virtual std::uint64_t parse(const TransferRing::Completion& completion,
                              std::vector<ParsedFrame>& frames);
};

/// The board of that name, without a serial number: "takktile", a shipped profile's name, or the
/// path of a profile. @throws Error
std::unique_ptr<Board> make_board(const std::string& name);

/// One of every board that Palpate knows by itself.
std::vector<std::unique_ptr<Board>> known_boards();

}  // namespace palpate
