#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "driver/deframer.hpp"
#include "driver/transfer_ring.hpp"
#include "driver/usb_device.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// The USB endpoint that carries a board's frames.
struct StreamSource {
  std::vector<int> interfaces;     ///< interfaces to claim, in this order
  std::uint8_t endpoint = 0;       ///< address of the bulk IN endpoint
  std::size_t transfer_bytes = 0;  ///< size of one bulk transfer
};

/// One kind of board: its USB ids, its requests and the meaning of its bytes. Use it from one
/// thread at a time. Every function that talks to the device throws Error.
class Board {
 public:
  virtual ~Board() = default;

  /// The name by which users open the board, such as "takktile".
  virtual const std::string& name() const = 0;
  /// Whether the board's USB ids are known; if not, the user must say which device the board is.
  virtual bool has_ids() const { return true; }
  /// Whether the device bears one of the board's USB ids.
  virtual bool fits(const UsbDevice& device) const = 0;
  /// Finds the endpoint of the stream from the device's descriptors alone.
  virtual StreamSource source(const UsbDevice& device) const = 0;

  /// Reads the board's geometry and calibration and makes a new deframer. Needs no claimed
  /// interface. Leaves the description's serial number to the caller.
  virtual SensorDescription configure(UsbHandle& handle) = 0;
  /// Makes the board send frames. The interfaces of source() must be claimed.
  virtual void start(UsbHandle& handle) = 0;
  virtual void stop(UsbHandle& handle) = 0;

  /// The deframer that the last configure() made.
  virtual Deframer& deframer() = 0;
  /// Passes the bytes of a transfer to the deframer and appends the frames that they complete.
  /// @return the number of frames known to be spoiled
  virtual std::uint64_t parse(const TransferRing::Completion& completion,
                              std::vector<ParsedFrame>& frames);
};

/// Makes the board of a name without serial number: "takktile", a shipped profile's name, or the
/// path of a profile. @throws Error (Fault::input)
std::unique_ptr<Board> make_board(const std::string& name);

/// One board of each kind that Palpate ships: the TakkTile and all shipped profiles.
std::vector<std::unique_ptr<Board>> known_boards();

/// The two parts of a board's name, such as "takktile:0012".
struct BoardName {
  std::string kind;   ///< "takktile", or the name or path of a profile
  std::string which;  ///< serial number or port of one board out of several, or ""
};
/// Splits a name at the colon behind its kind. @throws Error (Fault::input) for an empty part
BoardName parse_board_name(const std::string& name);

/// What tells the device from others of its kind: its serial number, or its port if it has no
/// serial number or another such device bears the same serial number.
std::string distinction(const Board& board, const UsbDevice& device,
                        const std::vector<UsbDevice>& devices);

/// The name that opens exactly this device out of `devices`.
std::string full_name(const Board& board, const UsbDevice& device,
                      const std::vector<UsbDevice>& devices);

/// Finds the one device of this kind whose serial number or port is `which`; "" fits every device.
/// @throws Error (Fault::input) if none or several fit, or a board without USB ids lacks `which`
UsbDevice choose_device(const std::vector<UsbDevice>& devices, const Board& board,
                        const std::string& which);

}  // namespace palpate
