#include "palpate/driver.hpp"

#include <algorithm>

#include "driver/board.hpp"
#include "driver/serial_profile.hpp"
#include "driver/usb_device.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Fills in what the board tells without disturbing a program that uses the board.
void inspect(Board& board, const UsbDevice& device, BoardInfo& info) {
  try {
    const StreamSource source = board.source(device);
    const bool taken = std::ranges::any_of(source.interfaces, [&](int interface) {
      return interface_driver(device, interface) == "usbfs";
    });
    if (taken) {
      info.reason = in_use(device);
      return;
    }
    UsbHandle handle(device);
    const SensorDescription description = board.configure(handle);
    info.elements = description.elements_mm.size();
    info.rate_hz = description.rate_hz;
    info.pressure_unit = description.pressure_unit;
    info.usable = true;
  } catch (const Error& error) {
    info.reason = error.what();
  }
}

}  // namespace

std::vector<BoardInfo> list_boards() {
  const UsbContext context;
  const std::vector<std::unique_ptr<Board>> boards = known_boards();
  std::vector<BoardInfo> infos;
  const std::vector<UsbDevice> devices = usb_devices(context);
  for (const UsbDevice& device : devices) {
    BoardInfo info{.name = {},
                   .bus = device.bus,
                   .address = device.address,
                   .vendor = device.vendor,
                   .product = device.product,
                   .manufacturer = device.manufacturer,
                   .product_name = device.product_name,
                   .serial = device.serial,
                   .pressure_unit = {},
                   .reason = "no board that is known by its USB ids"};
    const auto board = std::ranges::find_if(
        boards, [&](const std::unique_ptr<Board>& b) { return b->fits(device); });
    if (board != boards.end()) {
      info.reason.clear();
      info.name = full_name(**board, device, devices);
      inspect(**board, device, info);
    }
    infos.push_back(std::move(info));
  }
  return infos;
}

std::optional<std::filesystem::path> board_file(const std::string& name) {
  const std::string kind = parse_board_name(name).kind;
  return kind == takktile_kind ? std::nullopt : std::optional(profile_path(kind));
}

}  // namespace palpate
