#pragma once

#include <string>
#include <vector>

#include "board.hpp"
#include "usb_device.hpp"

namespace palpate {

/// The name of a board and, after the last colon, which of several: a serial number or a port.
struct BoardName {
  std::string kind;
  std::string which;
};
/// @throws Error
BoardName parse_board_name(const std::string& name);

/// What tells the device from others of its board: its serial number, or its port where it has none
/// or shares it, as copies of a board may.
std::string distinction(const Board& board, const UsbDevice& device,
                        const std::vector<UsbDevice>& devices);

/// The name under which this very device out of `devices` is opened.
std::string full_name(const Board& board, const UsbDevice& device,
                      const std::vector<UsbDevice>& devices);

/// The device that is meant. @throws Error where none is, or more than one
UsbDevice choose_device(const std::vector<UsbDevice>& devices, const Board& board,
                        const std::string& which);

}  // namespace palpate
