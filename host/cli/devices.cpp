#include "cli/commands.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/options.hpp"
#include "palpate/device.hpp"

namespace palpate::cli {

namespace {

void print_devices(bool json) {
  const std::vector<DeviceInfo> devices = Device::list();
  if (json) {
    auto list = nlohmann::ordered_json::array();
    for (const DeviceInfo& d : devices) {
      list.push_back({{"index", d.index},
                      {"name", d.name},
                      {"type", d.type},
                      {"driver", d.driver},
                      {"vulkan", d.api},
                      {"memory_gib", d.memory_gib},
                      {"usable", d.usable},
                      {"chosen", d.chosen},
                      {"reason", d.reason}});
    }
    fmt::print("{}\n", list.dump(2));
    return;
  }
  if (devices.empty()) {
    fmt::print("no Vulkan device; install a driver, on Debian: mesa-vulkan-drivers\n");
  }
  for (const DeviceInfo& d : devices) {
    fmt::print("{} {}  {}\n", d.chosen ? '*' : ' ', d.index, d.name);
    fmt::print("     {}, Vulkan {}, {:.1f} GiB, {}\n", d.type, d.api, d.memory_gib, d.driver);
    fmt::print("     {}: {}\n",
               d.chosen   ? "chosen"
               : d.usable ? "not chosen"
                          : "not usable",
               d.reason);
  }
}

}  // namespace

void add_devices(CLI::App& app) {
  const auto [command, json] = add_command<bool>(
      app, "devices", "List the Vulkan devices and why each is used or not; (*) marks the default",
      print_devices);
  command->add_flag("--json", *json, "Print the list as JSON");
}

}  // namespace palpate::cli
