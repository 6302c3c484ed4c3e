#include "driver/device.hpp"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <iterator>
#include <tuple>
#include <utility>

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

namespace fs = std::filesystem;

const fs::path sysfs_usb = "/sys/bus/usb/devices";
const fs::path sysfs_tty = "/sys/class/tty";

std::string first_line(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

template <class Number>
Number number(const fs::path& path, int base) {
  std::ifstream file(path);
  Number read = 0;
  file >> std::setbase(base) >> read;
  return read;
}

/// The folder's readable entries: what it shows may go meanwhile, or belong to other users.
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end;
       entry.increment(code)) {
    entries.push_back(entry->path());
  }
  return entries;
}

bool is_usb_device(const fs::path& folder) {
  std::error_code code;
  return fs::exists(folder / "idVendor", code);
}

ListedDevice describe(const fs::path& folder) {
  ListedDevice device{.node = {},
                      .bus = number<int>(folder / "busnum", 10),
                      .address = number<int>(folder / "devnum", 10),
                      .id = {number<std::uint16_t>(folder / "idVendor", 16),
                             number<std::uint16_t>(folder / "idProduct", 16)},
                      .port = folder.filename(),
                      .serial = first_line(folder / "serial"),
                      .manufacturer = first_line(folder / "manufacturer"),
                      .product_name = first_line(folder / "product")};
  device.node = fmt::format("/dev/bus/usb/{:03}/{:03}", device.bus, device.address);
  return device;
}

std::vector<ListedDevice> sorted(std::vector<ListedDevice> devices) {
  std::ranges::sort(devices, {},
                    [](const ListedDevice& d) { return std::tuple(d.bus, d.address, d.node); });
  return devices;
}

/// Whether the paths lead to one file or, as a container's /dev may lie elsewhere, to one device.
bool same(const std::string& one, const std::string& other) {
  struct stat a {};
  struct stat b {};
  return stat(one.c_str(), &a) == 0 && stat(other.c_str(), &b) == 0 &&
         ((a.st_dev == b.st_dev && a.st_ino == b.st_ino) ||
          (S_ISCHR(a.st_mode) && S_ISCHR(b.st_mode) && a.st_rdev == b.st_rdev));
}

bool holds(const fs::path& process, const std::string& node) {
  return std::ranges::any_of(entries_of(process / "fd"),
                             [&](const fs::path& file) { return same(file, node); });
}

/// The file that holds this code; empty if unknown.
std::filesystem::path own_file() {
  Dl_info info{};
  void* found = nullptr;
  // Any address of this code will do.
  if (dladdr1(reinterpret_cast<const void*>(&data_folder), &info, &found, RTLD_DL_LINKMAP) == 0) {
    return {};
  }
  const std::filesystem::path name = static_cast<const link_map*>(found)->l_name;
  return name.empty() ? "/proc/self/exe" : name;  // the program itself has no name there
}

}  // namespace

std::filesystem::path data_folder() {
  std::error_code code;
  auto folder = std::filesystem::weakly_canonical(own_file(), code).parent_path();
  // From lib/x86_64-linux-gnu up to the prefix: two folders.
  for (int up = 0; up < 3; ++up, folder = folder.parent_path()) {
    auto data = folder / "share" / "palpate";
    if (std::filesystem::is_directory(data, code)) {
      return data;
    }
  }
  return PALPATE_INSTALLED_DATA;
}

std::string ListedDevice::place() const {
  return fmt::format("USB device {:04x}:{:04x} at {}", id.vendor, id.product, port);
}

std::vector<ListedDevice> usb_devices() {
  const std::string hub_class = "09";
  std::vector<ListedDevice> devices;
  for (const fs::path& folder : entries_of(sysfs_usb)) {
    if (is_usb_device(folder) && first_line(folder / "bDeviceClass") != hub_class) {
      devices.push_back(describe(folder));
    }
  }
  return sorted(std::move(devices));
}

std::vector<ListedDevice> serial_ports() {
  std::vector<ListedDevice> ports;
  for (const fs::path& tty : entries_of(sysfs_tty)) {
    std::error_code code;
    fs::path folder = fs::canonical(tty, code);
    while (folder.has_relative_path() && !is_usb_device(folder)) {
      folder = folder.parent_path();
    }
    if (folder.has_relative_path()) {
      ListedDevice& port = ports.emplace_back(describe(folder));
      port.node = fs::path("/dev") / tty.filename();
    }
  }
  return sorted(std::move(ports));
}

std::vector<ListedDevice> with_id(std::vector<ListedDevice> devices,
                                  const std::vector<UsbId>& ids) {
  std::erase_if(devices, [&](const ListedDevice& device) {
    return std::ranges::find(ids, device.id) == ids.end();
  });
  return devices;
}

bool is_claimed(const ListedDevice& device) {
  return std::ranges::any_of(entries_of(sysfs_usb / device.port), [](const fs::path& folder) {
    std::error_code code;
    return fs::read_symlink(folder / "driver", code).filename() == "usbfs";
  });
}

std::vector<std::string> holders(const std::string& node) {
  std::vector<std::string> programs;
  for (const fs::path& process : entries_of("/proc")) {
    const std::string id = process.filename();
    if (id.find_first_not_of("0123456789") == std::string::npos && id != std::to_string(getpid()) &&
        holds(process, node)) {
      programs.push_back(fmt::format("{} (process {})", first_line(process / "comm"), id));
    }
  }
  return programs;
}

std::string in_use(const std::string& node) {
  const std::vector<std::string> programs = holders(node);
  return programs.empty()
             ? "in use by another program, or opened twice by this program; end the other use"
             : fmt::format("in use by {}; end that program", fmt::join(programs, ", "));
}

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
                            "serial number, port or device file; see palpate sensors",
                            name));
  }
  return parsed;
}

std::string distinction(const ListedDevice& device, const std::vector<ListedDevice>& others) {
  for (const auto part : {&ListedDevice::serial, &ListedDevice::port}) {
    const auto bearers = std::ranges::count(others, device.*part, part);
    if (!(device.*part).empty() && bearers <= 1) {
      return device.*part;
    }
  }
  return device.node;
}

ListedDevice choose_device(const std::vector<ListedDevice>& candidates, const std::string& kind,
                           const std::string& which) {
  std::vector<ListedDevice> fitting;
  std::ranges::copy_if(candidates, std::back_inserter(fitting), [&](const ListedDevice& device) {
    return which.empty() || which == device.serial || which == device.port || which == device.node;
  });
  if (fitting.empty()) {
    throw Error(Fault::input, fmt::format("sensor '{}{}{}': not plugged in; see palpate sensors",
                                          kind, which.empty() ? "" : ":", which));
  }
  if (fitting.size() > 1) {
    std::vector<std::string> names;
    for (const ListedDevice& device : fitting) {
      names.push_back(fmt::format("{}:{}", kind, distinction(device, candidates)));
    }
    throw Error(Fault::input,
                fmt::format("sensor '{}': {} such boards are plugged in; name one: {}", kind,
                            names.size(), fmt::join(names, ", ")));
  }
  return fitting.front();
}

}  // namespace palpate
