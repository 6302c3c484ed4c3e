#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

// The kernel's own termios takes every baud rate, <termios.h> those of a list; both declare it.
#include <asm/termbits.h>
#include <fmt/format.h>
#include <grp.h>
#include <linux/serial.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include "driver/deframer.hpp"
#include "driver/device.hpp"
#include "driver/open_sensor.hpp"
#include "driver/queued_sensor.hpp"
#include "driver/serial_profile.hpp"
#include "model/descriptor.hpp"
#include "model/stream_time.hpp"
#include "palpate/error.hpp"
#include "palpate/sensor.hpp"

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

Descriptor opened(const std::string& node) {
  // Without O_NONBLOCK, a port without carrier would not open.
  Descriptor port(node, O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (!port.valid()) {
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

/// A serial port of the kernel's, such as /dev/ttyUSB0, opened for this program alone.
class SerialPort {
 public:
  /// Opens the port with these settings of the line. @throws Error naming the port and the remedy
  SerialPort(const std::string& node, const SerialLine& line) : node_(node), port_(opened(node)) {
    termios2 settings{};
    if (ioctl(port_.get(), TCGETS2, &settings) != 0) {
      throw Error(Fault::input, node_ + ": is no serial port; check the path");
    }
    // The lock keeps out programs that ask for it, root's too; TIOCEXCL keeps out every other
    // user's.
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
  ~SerialPort() { ioctl(port_.get(), TIOCNXCL); }
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Forgets what came and was not read. @throws Error where the device is gone
  void flush() {
    if (ioctl(port_.get(), TCFLSH, TCIFLUSH) != 0) {
      refuse(gone);
    }
  }

  /// @throws Error where the device takes not all bytes
  void write(const std::vector<std::uint8_t>& bytes) {
    // A profile has at most 256 bytes to send, for which every driver has room.
    const ssize_t taken = ::write(port_.get(), bytes.data(), bytes.size());
    if (taken < 0 && errno != EAGAIN) {
      refuse(gone);
    }
    if (taken != static_cast<ssize_t>(bytes.size())) {
      refuse("does not take the bytes that the profile sends; check that it is the right board");
    }
  }

  /// Takes the bytes that come, up to the room in `buffer`: none where none come in time.
  /// @throws Error where the device is gone
  std::span<const std::uint8_t> read(std::span<std::uint8_t> buffer) {
    // How long stop() waits for a silent board.
    constexpr int patience_ms = 50;
    pollfd file{.fd = port_.get(), .events = POLLIN, .revents = 0};
    poll(&file, 1, patience_ms);
    const ssize_t count = ::read(port_.get(), buffer.data(), buffer.size());
    if (count > 0) {
      return buffer.first(static_cast<std::size_t>(count));
    }
    if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
      refuse(gone);
    }
    return {};
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(Fault::system, fmt::format("{}: {}", node_, what));
  }

  std::string node_;
  Descriptor port_;
};

/// A sensor that streams from a board behind a serial port. Once the board is gone, next() throws
/// until start() finds it again.
class SerialSensor final : public QueuedSensor {
 public:
  SerialSensor(SerialProfile profile, std::string kind, std::string which)
      : profile_(std::move(profile)), kind_(std::move(kind)), which_(std::move(which)) {
    if (profile_.usb.empty() && which_.empty()) {
      throw Error(Fault::input,
                  fmt::format("sensor '{0}': its USB ids differ from maker to maker; say which "
                              "device it is by its serial number, port or device file, as in "
                              "{0}:/dev/ttyUSB0; see palpate sensors",
                              kind_));
    }
    connect();
  }

  ~SerialSensor() override { stop(); }

  void start() override {
    stop();
    forget();
    begin();
    stopping_ = false;
    thread_ = std::thread([this] { run(); });
  }

  void stop() override {
    if (!thread_.joinable()) {
      return;
    }
    stopping_ = true;
    thread_.join();
    try {
      if (port_) {
        port_->write(profile_.stop);
      }
    } catch (const Error&) {
      // The board may be unplugged; it is stopped either way.
    }
  }

 private:
  /// Opens the port of the one board that is meant, and then knows it by what tells it apart.
  void connect() {
    const std::vector<ListedDevice> ports = serial_ports();
    ListedDevice device{.node = which_};
    if (which_.starts_with('/')) {
      // Opens what is not listed, too: a port of the mainboard, a link in /dev/serial/by-id.
      const auto listed = std::ranges::find(ports, which_, &ListedDevice::node);
      device = listed == ports.end() ? device : *listed;
    } else {
      const std::vector<ListedDevice> boards =
          profile_.usb.empty() ? ports : with_id(ports, profile_.usb);
      device = choose_device(boards, kind_, which_);
      which_ = distinction(device, boards);
    }
    port_ = std::make_unique<SerialPort>(device.node, profile_.line);
    description_ = {.name = profile_.name,
                    .serial = device.serial,
                    .pressure_unit = profile_.pressure_unit,
                    .elements_mm = profile_.elements_mm,
                    .rate_hz = profile_.rate_hz};
  }

  void begin() {
    try {
      if (port_) {
        port_->flush();
      }
    } catch (const Error&) {
      port_.reset();
    }
    if (!port_) {  // a board that was unplugged since is a new device to the kernel
      connect();
    }
    deframer_.emplace(profile_.packet);
    port_->write(profile_.start);
  }

  void run() {
    try {
      std::vector<std::uint8_t> buffer(1 << 16);
      do {
        deliver(port_->read(buffer));
      } while (!stopping_);
    } catch (...) {
      port_.reset();  // a port that hung up would keep its name from the board that comes back
      fail();
    }
  }

  void deliver(std::span<const std::uint8_t> bytes) {
    const double host_time_s = host_clock_s();
    parsed_.clear();
    const std::uint64_t lost_before = deframer_->counters().checksum_errors;
    deframer_->push(bytes, parsed_);
    SensorCounters counters = deframer_->counters();
    counters.lost = counters.checksum_errors;
    lose(counters.lost - lost_before);
    for (Frame& frame : parsed_) {
      push(std::move(frame), host_time_s);
    }
    publish(counters);
  }

  SerialProfile profile_;
  std::string kind_;
  std::string which_;

  // Between start() and stop(), only the sensor's thread reads the port and uses these.
  std::unique_ptr<SerialPort> port_;
  std::optional<PacketDeframer> deframer_;
  std::vector<Frame> parsed_;

  std::atomic<bool> stopping_ = false;
};

}  // namespace

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

std::unique_ptr<Sensor> open_serial_board(SerialProfile profile, const std::string& kind,
                                          const std::string& which) {
  return std::make_unique<SerialSensor>(std::move(profile), kind, which);
}

}  // namespace palpate
