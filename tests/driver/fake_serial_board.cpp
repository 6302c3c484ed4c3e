#include "fake_serial_board.hpp"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

// The kernel's own termios tells every baud rate.
#include <asm/termbits.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "streamed.hpp"

namespace palpate {

namespace {

[[noreturn]] void no_terminal(const char* call) {
  throw std::runtime_error(fmt::format("{}: {}; the test needs a pseudo-terminal: mount devpts",
                                       call, std::strerror(errno)));
}

bool becomes_ready(int file, short events) {
  pollfd ready{.fd = file, .events = events, .revents = 0};
  return poll(&ready, 1, static_cast<int>(std::chrono::milliseconds(patience).count())) > 0;
}

termios2 settings_of(int file) {
  termios2 settings{};
  if (ioctl(file, TCGETS2, &settings) != 0) {
    no_terminal("TCGETS2");
  }
  return settings;
}

/// One interface of the vendor's class.
const Bytes one_interface = {9, 2, 18, 0, 1, 1, 0, 0x80, 50, 9, 4, 0, 0, 0, 0xff, 0, 0, 0};

}  // namespace

FakePort::FakePort(FakeUsb& usb) : far_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
  if (far_ < 0 || grantpt(far_) != 0 || unlockpt(far_) != 0) {
    no_terminal("posix_openpt");
  }
  node_ = ptsname(far_);
  usb.pass_on(node_);
}

FakePort::~FakePort() {
  close(far_);
  close(near_);
}

void FakePort::send(const Bytes& bytes) const {
  std::size_t sent = 0;
  ssize_t taken = 1;
  while (sent < bytes.size() && taken > 0 && becomes_ready(far_, POLLOUT)) {
    taken = write(far_, bytes.data() + sent, bytes.size() - sent);
    sent += taken > 0 ? static_cast<std::size_t>(taken) : 0;
  }
}

Bytes FakePort::received(std::size_t count) const {
  Bytes bytes(count);
  std::size_t filled = 0;
  ssize_t taken = 1;
  while (filled < count && taken > 0 && becomes_ready(far_, POLLIN)) {
    taken = read(far_, bytes.data() + filled, count - filled);
    filled += taken > 0 ? static_cast<std::size_t>(taken) : 0;
  }
  bytes.resize(filled);
  return bytes;
}

void FakePort::watch() {
  near_ = open(node_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (near_ < 0) {
    no_terminal(node_.c_str());
  }
}

int FakePort::unread() const {
  int count = -1;
  ioctl(near_, FIONREAD, &count);
  return count;
}

unsigned FakePort::baud() const { return settings_of(far_).c_ospeed; }
bool FakePort::two_stop_bits() const { return (settings_of(far_).c_cflag & CSTOPB) != 0; }

FakeSerialBoard::FakeSerialBoard(FakeUsb& usb, const std::string& serial, Ids ids, int address,
                                 bool has_driver)
    : usb_(usb),
      device_(usb, address,
              {.vendor = ids.vendor,
               .product = ids.product,
               .manufacturer = "Maker",
               .product_name = "Serial board",
               .serial = serial},
              one_interface, [](const FakeUsbDevice::Setup&) { return std::nullopt; }),
      number_(address) {
  if (has_driver) {
    show_port();
  }
}

FakeSerialBoard::~FakeSerialBoard() { unplug(); }

void FakeSerialBoard::plug() {
  device_.plug();
  ++number_;
  show_port();
}

void FakeSerialBoard::unplug() {
  if (port_) {
    umockdev_testbed_remove_device(usb_.testbed(), ("/sys" + syspath()).c_str());
    std::filesystem::remove(usb_.root() + node());
    port_.reset();
  }
  device_.unplug();
}

void FakeSerialBoard::show_port() {
  tty_ = fmt::format("ttyUSB{}", number_);
  port_.emplace(usb_);
  std::filesystem::create_directories(usb_.root() + "/dev");
  std::filesystem::create_symlink(port_->node(), usb_.root() + node());
  usb_.pass_on(node());
  usb_.add(fmt::format("P: {}\nE: SUBSYSTEM=tty\n", syspath()));
}

std::string FakeSerialBoard::syspath() const {
  return fmt::format("{}/{}:1.0/tty/{}", device_.syspath(), device_.port(), tty_);
}

}  // namespace palpate
