#include "driver/serial_port.hpp"

#include <cerrno>
#include <cstring>

// The kernel's own termios takes every baud rate, <termios.h> those of a list; both declare it.
#include <asm/termbits.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "driver/device.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr const char* gone = "hung up: the board was unplugged; plug it in and start again";

std::string missing_permission(const std::string& node) {
  struct stat file {};
  const group* owner = stat(node.c_str(), &file) == 0 ? getgrgid(file.st_gid) : nullptr;
  return fmt::format(
      "no permission to open it; join its group with 'sudo usermod -aG {} $USER' and log in again",
      owner != nullptr ? owner->gr_name : "dialout");
}

int opened(const std::string& node) {
  // Without O_NONBLOCK, a port without carrier would not open.
  const int port = open(node.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port < 0) {
    const Fault fault = errno == ENOENT ? Fault::input : Fault::system;
    throw Error(fault, fmt::format("{}: {}", node, why_not_opened(node, errno)));
  }
  return port;
}

tcflag_t control_flags(const SerialLine& line) {
  constexpr tcflag_t sizes[] = {CS5, CS6, CS7, CS8};
  tcflag_t flags = BOTHER | CREAD | CLOCAL | HUPCL | sizes[line.data_bits - 5];
  flags |= line.parity == SerialLine::Parity::none ? 0 : PARENB;
  flags |= line.parity == SerialLine::Parity::odd ? PARODD : 0;
  flags |= line.stop_bits == 2 ? CSTOPB : 0;
  return flags;
}

}  // namespace

FileDescriptor::~FileDescriptor() { close(number_); }

std::string why_not_opened(const std::string& node, int code) {
  switch (code) {
    case EACCES:
    case EPERM:
      return missing_permission(node);
    case EBUSY:
      return in_use(node);
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "not plugged in; see palpate sensors";
    default:
      return fmt::format("cannot be opened: {}; check the path", std::strerror(code));
  }
}

SerialPort::SerialPort(const std::string& node, const SerialLine& line)
    : node_(node), port_(opened(node)) {
  termios2 settings{};
  if (ioctl(port_.get(), TCGETS2, &settings) != 0) {
    throw Error(Fault::input, node_ + ": is no serial port; check the path");
  }
  // The lock keeps out programs that ask for it, root's too; TIOCEXCL keeps out every other user's.
  if (flock(port_.get(), LOCK_EX | LOCK_NB) != 0) {
    refuse(in_use(node_));
  }
  ioctl(port_.get(), TIOCEXCL);
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = control_flags(line);
  settings.c_ispeed = line.baud;
  settings.c_ospeed = line.baud;
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (ioctl(port_.get(), TCSETS2, &settings) != 0) {
    refuse(fmt::format("refuses {} baud with {} data bits: {}; check 'line' in the profile",
                       line.baud, line.data_bits, std::strerror(errno)));
  }
  // An FTDI chip otherwise keeps bytes for 16 ms. Ports without such a timer refuse.
  serial_struct chip{};
  if (ioctl(port_.get(), TIOCGSERIAL, &chip) == 0) {
    chip.flags |= ASYNC_LOW_LATENCY;
    ioctl(port_.get(), TIOCSSERIAL, &chip);
  }
}

// A port that another program has open, too, would stay closed to users.
SerialPort::~SerialPort() { ioctl(port_.get(), TIOCNXCL); }

void SerialPort::refuse(const std::string& what) const {
  throw Error(Fault::system, fmt::format("{}: {}", node_, what));
}

void SerialPort::flush() {
  if (ioctl(port_.get(), TCFLSH, TCIFLUSH) != 0) {
    refuse(gone);
  }
}

void SerialPort::write(const std::vector<std::uint8_t>& bytes) {
  // A profile has at most 256 bytes to send, for which every driver has room.
  const ssize_t taken = ::write(port_.get(), bytes.data(), bytes.size());
  if (taken < 0 && errno != EAGAIN) {
    refuse(gone);
  }
  if (taken != static_cast<ssize_t>(bytes.size())) {
    refuse("does not take the bytes that the profile sends; check that it is the right board");
  }
}

bool SerialPort::wait(const FileDescriptor& wake) {
  pollfd files[] = {{.fd = port_.get(), .events = POLLIN, .revents = 0},
                    {.fd = wake.get(), .events = POLLIN, .revents = 0}};
  poll(files, 2, -1);
  return (files[1].revents & POLLIN) != 0;
}

std::span<const std::uint8_t> SerialPort::read(std::span<std::uint8_t> buffer) {
  const ssize_t count = ::read(port_.get(), buffer.data(), buffer.size());
  if (count > 0) {
    return buffer.first(static_cast<std::size_t>(count));
  }
  if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
    refuse(gone);
  }
  return {};
}

}  // namespace palpate
