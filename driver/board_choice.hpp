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

/// The name under which this very device is opened.
std::string full_name(const Board& board, const UsbDevice& device);

/// The device that is meant. @throws Error where none is, or more than one
UsbDevice choose_device(const std::vector<UsbDevice>& devices, const Board& board,
                        const std::string& which);

}  // namespace palpate
