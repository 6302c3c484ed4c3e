#include "driver/usb_fault.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include <fmt/format.h>

#include "driver/data_folder.hpp"

namespace palpate {

namespace {

namespace fs = std::filesystem;

/// The folder's readable entries: processes may end meanwhile, or belong to other users.
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end;
       entry.increment(code)) {
    entries.push_back(entry->path());
  }
  return entries;
}

bool holds(const fs::path& process, const std::string& node) {
  return std::ranges::any_of(entries_of(process / "fd"), [&](const fs::path& file) {
    std::error_code code;
    // Compare the end only: a container's /dev may lie elsewhere.
    return fs::read_symlink(file, code).string().ends_with(node);
  });
}

/// The programs that have the file open, as "name (process 123)".
std::vector<std::string> holders(const std::string& node) {
  std::vector<std::string> programs;
  for (const fs::path& process : entries_of("/proc")) {
    const std::string id = process.filename();
    if (id.find_first_not_of("0123456789") == std::string::npos && id != std::to_string(getpid()) &&
        holds(process, node)) {
      std::string name;
      std::ifstream comm(process / "comm");
      std::getline(comm, name);
      programs.push_back(fmt::format("{} (process {})", name, id));
    }
  }
  return programs;
}

std::string missing_permission(const UsbDevice& device) {
  const std::string rules = (data_folder() / "70-palpate.rules").string();
  return fmt::format(
      "no permission to open {}; install the udev rule with 'sudo cp {} /etc/udev/rules.d/ && sudo "
      "udevadm control --reload && sudo udevadm trigger', then log in at this machine or join the "
      "group plugdev",
      device.node(), rules);
}

std::string help(const UsbDevice& device, int code) {
  switch (code) {
    case LIBUSB_ERROR_ACCESS:
      return missing_permission(device);
    case LIBUSB_ERROR_BUSY:
      return in_use(device);
    case LIBUSB_ERROR_NO_DEVICE:
      return "it is unplugged; plug it in again";
    case LIBUSB_ERROR_PIPE:
      return "it refuses the request; check the board's firmware";
    case LIBUSB_ERROR_TIMEOUT:
      return "it does not answer; unplug it and plug it in again";
    default:
      return fmt::format("{}; unplug it and plug it in again", libusb_strerror(code));
  }
}

}  // namespace

std::string in_use(const UsbDevice& device) {
  const std::vector<std::string> programs = holders(device.node());
  return programs.empty()
             ? "in use by another program, or opened twice by this program; end the other use"
             : fmt::format("in use by {}; end that program", fmt::join(programs, ", "));
}

Error usb_fault(const UsbDevice& device, const std::string& what, int code) {
  return {Fault::system, fmt::format("{}: {}: {}", device.place(), what, help(device, code))};
}

}  // namespace palpate
