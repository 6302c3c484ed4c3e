#include "driver/board_choice.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

bool could_be(const UsbDevice& device, const Board& board) {
  return !board.has_ids() || board.fits(device);
}

}  // namespace

BoardName parse_board_name(const std::string& name) {
  // A path may hold colons: the kind ends behind a profile's suffix, or else at the first colon.
  const std::string suffix = ".yaml";
  const std::size_t end = name.find(suffix + ":");
  const std::size_t colon = end != std::string::npos ? end + suffix.size()
                            : name.ends_with(suffix) ? std::string::npos
                                                     : name.find(':');
  BoardName parsed{.kind = name.substr(0, colon),
                   .which = colon == std::string::npos ? "" : name.substr(colon + 1)};
  if (parsed.kind.empty() || (colon != std::string::npos && parsed.which.empty())) {
    throw Error(Fault::input,
                fmt::format("sensor '{}': must be a board's name, or its name, a colon and its "
                            "serial number; see palpate sensors",
                            name));
  }
  return parsed;
}

std::string distinction(const Board& board, const UsbDevice& device,
                        const std::vector<UsbDevice>& devices) {
  const auto bearers = std::ranges::count_if(devices, [&](const UsbDevice& other) {
    return could_be(other, board) && other.serial == device.serial;
  });
  return device.serial.empty() || bearers > 1 ? device.port : device.serial;
}

std::string full_name(const Board& board, const UsbDevice& device,
                      const std::vector<UsbDevice>& devices) {
  return fmt::format("{}:{}", board.name(), distinction(board, device, devices));
}

UsbDevice choose_device(const std::vector<UsbDevice>& devices, const Board& board,
                        const std::string& which) {
  if (!board.has_ids() && which.empty()) {
    throw Error(
        Fault::input,
        fmt::format("sensor '{0}': its USB ids differ from maker to maker; say which device "
                    "it is by its serial number or port, as in {0}:1-2; see palpate sensors",
                    board.name()));
  }
  std::vector<UsbDevice> fitting;
  std::ranges::copy_if(devices, std::back_inserter(fitting), [&](const UsbDevice& device) {
    return could_be(device, board) &&
           (which.empty() || which == device.serial || which == device.port);
  });
  if (fitting.empty()) {
    throw Error(Fault::input, fmt::format("sensor '{}{}{}': not plugged in; see palpate sensors",
                                          board.name(), which.empty() ? "" : ":", which));
  }
  if (fitting.size() > 1) {
    std::vector<std::string> names;
    for (const UsbDevice& device : fitting) {
      names.push_back(full_name(board, device, devices));
    }
    throw Error(Fault::input,
                fmt::format("sensor '{}': {} such boards are plugged in; name one: {}",
                            board.name(), names.size(), fmt::join(names, ", ")));
  }
  return fitting.front();
}

}  // namespace palpate
