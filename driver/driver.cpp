#include "palpate/driver.hpp"

#include <algorithm>
#include <cerrno>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "driver/device.hpp"
#include "driver/open_sensor.hpp"
#include "driver/serial_profile.hpp"
#include "driver/takktile_protocol.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

void inspect_takktile(const ListedDevice& device, BoardInfo& info) {
  if (is_claimed(device)) {
    info.reason = in_use(device.node);
    return;
  }
  try {
    const SensorDescription description = describe_takktile(device);
    info.elements = description.elements_mm.size();
    info.pressure_unit = description.pressure_unit;
    info.usable = true;
  } catch (const Error& error) {
    info.reason = error.what();
  }
}

/// Fills in what the profile says. The port is not opened, which would restart many a board.
void inspect_serial_board(const SerialProfile& profile, BoardInfo& info) {
  info.elements = profile.elements_mm.size();
  info.rate_hz = profile.rate_hz;
  info.pressure_unit = profile.pressure_unit;
  if (info.serial_port.empty()) {
    info.reason = "the kernel has no serial port for it; load its driver, 'sudo modprobe cdc_acm'";
  } else if (access(info.serial_port.c_str(), R_OK | W_OK) != 0) {
    info.reason = why_not_opened(info.serial_port, errno);
  } else if (!holders(info.serial_port).empty()) {
    info.reason = in_use(info.serial_port);
  } else {
    info.usable = true;
  }
}

}  // namespace

std::vector<BoardInfo> list_boards() {
  const std::vector<ListedDevice> devices = usb_devices();
  const std::vector<ListedDevice> ports = serial_ports();
  std::map<std::string, SerialProfile> profiles;
  for (const std::string& name : shipped_profiles()) {
    profiles.emplace(name, read_serial_profile(name));
  }
  std::vector<BoardInfo> infos;
  for (const ListedDevice& device : devices) {
    const auto port = std::ranges::find(ports, device.port, &ListedDevice::port);
    const std::string node = port == ports.end() ? "" : port->node;
    BoardInfo& info = infos.emplace_back(BoardInfo{.name = {},
                                                   .bus = device.bus,
                                                   .address = device.address,
                                                   .vendor = device.id.vendor,
                                                   .product = device.id.product,
                                                   .manufacturer = device.manufacturer,
                                                   .product_name = device.product_name,
                                                   .serial = device.serial,
                                                   .serial_port = node,
                                                   .pressure_unit = {},
                                                   .reason = {}});
    const auto named = [&](const std::string& kind, const std::vector<UsbId>& ids) {
      const bool has_port = port != ports.end();
      return fmt::format(
          "{}:{}", kind,
          distinction(has_port ? *port : device, with_id(has_port ? ports : devices, ids)));
    };
    const auto board = std::ranges::find_if(
        profiles, [&](const auto& known) { return !with_id({device}, known.second.usb).empty(); });
    if (device.id == takktile::usb_id) {
      info.name = named(takktile_kind, {takktile::usb_id});
      inspect_takktile(device, info);
    } else if (board != profiles.end()) {
      info.name = named(board->first, board->second.usb);
      inspect_serial_board(board->second, info);
    } else {
      info.reason = "no board that is known by its USB ids";
      info.reason +=
          node.empty() ? "" : "; where a profile describes it, PROFILE:" + node + " opens it";
    }
  }
  return infos;
}

std::optional<std::filesystem::path> board_file(const std::string& name) {
  const std::string kind = parse_board_name(name).kind;
  return kind == takktile_kind ? std::nullopt : std::optional(profile_path(kind));
}

std::unique_ptr<Sensor> open_board(const std::string& name) {
  const auto [kind, which] = parse_board_name(name);
  return kind == takktile_kind ? open_takktile(which)
                               : open_serial_board(read_serial_profile(kind), kind, which);
}

}  // namespace palpate
