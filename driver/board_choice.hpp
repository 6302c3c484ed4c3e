#pragma once

#include <string>
#include <vector>

#include "driver/board.hpp"
#include "driver/usb_device.hpp"

namespace palpate {

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
