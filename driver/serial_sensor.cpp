#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/eventfd.h>

#include "driver/device.hpp"
#include "driver/frame_queue.hpp"
#include "driver/open_sensor.hpp"
#include "driver/serial_port.hpp"
#include "driver/serial_profile.hpp"
#include "palpate/error.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

namespace {

int new_event() {
  const int event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (event < 0) {
    throw Error(Fault::system, "serial port: too many open files; close some");
  }
  return event;
}

/// A sensor that streams from a board behind a serial port.
///
/// Between start() and stop(), a thread of the sensor's own reads the port and passes frames to
/// next() through a queue. Once the board is gone, next() throws until start() finds it again.
class SerialSensor final : public Sensor {
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

  SerialSensor(const SerialSensor&) = delete;
  SerialSensor& operator=(const SerialSensor&) = delete;

  const SensorDescription& description() const override { return description_; }

  void start() override {
    stop();
    queue_.clear();
    lost_before_next_ = 0;
    publish({});
    begin();
    thread_ = std::thread([this] { run(); });
  }

  std::optional<Frame> next(std::chrono::milliseconds timeout) override {
    return queue_.pop(timeout);
  }

  void stop() override {
    if (!thread_.joinable()) {
      return;
    }
    eventfd_write(stopping_.get(), 1);
    thread_.join();
    eventfd_t count = 0;
    eventfd_read(stopping_.get(), &count);
    try {
      if (port_) {
        port_->write(profile_.stop);
      }
    } catch (const Error&) {
      // The board may be unplugged; it is stopped either way.
    }
  }

  SensorCounters counters() const override {
    const FrameQueue::Counters queue = queue_.counters();
    const std::lock_guard lock(mutex_);
    SensorCounters counters = published_;
    counters.frames = queue.pushed - queue.dropped;
    counters.lost += queue.dropped;
    return counters;
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
    deframer_ = make_deframer(profile_);
    port_->write(profile_.start);
  }

  void run() {
    try {
      std::vector<std::uint8_t> buffer(1 << 16);
      for (bool stopping = false; !stopping;) {
        stopping = port_->wait(stopping_);
        deliver(port_->read(buffer));
      }
    } catch (...) {
      port_.reset();  // a port that hung up would keep its name from the board that comes back
      queue_.fail(std::current_exception());
    }
  }

  void deliver(std::span<const std::uint8_t> bytes) {
    const double host_time_s = host_clock_s();
    parsed_.clear();
    const std::uint64_t damaged_before = deframer_->counters().checksum_errors;
    deframer_->push(bytes, parsed_);
    const DeframerCounters& counted = deframer_->counters();
    lost_before_next_ += counted.checksum_errors - damaged_before;
    for (ParsedFrame& frame : parsed_) {
      queue_.push({.host_time_s = host_time_s,
                   .device_time_s = frame.device_time_s,
                   .values = std::move(frame.values),
                   .lost_before = std::exchange(lost_before_next_, 0)});
    }
    publish({.lost = counted.checksum_errors,
             .checksum_errors = counted.checksum_errors,
             .garbage_bytes = counted.garbage_bytes});
  }

  void publish(const SensorCounters& counters) {
    const std::lock_guard lock(mutex_);
    published_ = counters;
  }

  SerialProfile profile_;
  std::string kind_;
  std::string which_;
  SensorDescription description_;

  // Between start() and stop(), only the sensor's thread reads the port and uses these.
  std::unique_ptr<SerialPort> port_;
  std::unique_ptr<Deframer> deframer_;
  std::vector<ParsedFrame> parsed_;
  std::uint64_t lost_before_next_ = 0;

  std::thread thread_;
  FileDescriptor stopping_{new_event()};  // readable once stop() is called
  FrameQueue queue_;
  mutable std::mutex mutex_;
  SensorCounters published_;  // guarded by mutex_
};

}  // namespace

std::unique_ptr<Sensor> open_serial_board(SerialProfile profile, const std::string& kind,
                                          const std::string& which) {
  return std::make_unique<SerialSensor>(std::move(profile), kind, which);
}

}  // namespace palpate
