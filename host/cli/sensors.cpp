#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "model/printable.hpp"
#include "palpate/driver.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

void print_json(const std::vector<BoardInfo>& boards) {
  auto list = nlohmann::ordered_json::array();
  for (const BoardInfo& b : boards) {
    list.push_back({{"name", b.name},
                    {"bus", b.bus},
                    {"address", b.address},
                    {"vendor", fmt::format("{:04x}", b.vendor)},
                    {"product", fmt::format("{:04x}", b.product)},
                    {"manufacturer", b.manufacturer},
                    {"product_name", b.product_name},
                    {"serial", b.serial},
                    {"serial_port", b.serial_port},
                    {"elements", b.elements},
                    {"rate_hz", b.rate_hz},
                    {"pressure_unit", b.pressure_unit},
                    {"usable", b.usable},
                    {"reason", b.reason}});
  }
  fmt::print("{}", text_of(list, 2));  // a device's strings need not be UTF-8, as JSON must
}

void print_text(const std::vector<BoardInfo>& boards) {
  if (boards.empty()) {
    fmt::print("no USB devices\n");
  }
  for (const BoardInfo& b : boards) {
    const std::string named = b.manufacturer.empty() && b.product_name.empty()
                                  ? "nameless device"
                                  : printable(b.manufacturer + " " + b.product_name);
    fmt::print("{} {:04x}:{:04x}  {}\n", b.usable ? '*' : ' ', b.vendor, b.product,
               b.name.empty() ? named : printable(b.name));
    fmt::print("     bus {}, address {}, serial {}{}\n", b.bus, b.address,
               b.serial.empty() ? "none" : printable(b.serial),
               b.serial_port.empty() ? "" : ", " + b.serial_port);
    if (b.usable) {
      fmt::print("     {} elements, {}, {}\n", b.elements, b.pressure_unit,
                 b.rate_hz > 0 ? fmt::format("{} frames/s", b.rate_hz) : "rate not known");
    } else {
      fmt::print("     {}: {}\n", b.name.empty() ? "not known" : "not usable", b.reason);
    }
  }
}

}  // namespace

void add_sensors(CLI::App& app) {
  const auto [command, json] = add_command<bool>(
      app, "sensors", "List the USB devices; (*) marks the usable boards, others are explained",
      [](bool as_json) { (as_json ? print_json : print_text)(list_boards()); });
  command->add_flag("--json", *json, "Print the list as JSON");
}

}  // namespace palpate::cli
