#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "driver/open_sensor.hpp"
#include "driver/queued_sensor.hpp"
#include "driver/serial_profile.hpp"
#include "driver/takktile_protocol.hpp"
#include "driver/usb_device.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace takktile {

namespace {

// wIndex starts and stops the stream. The firmware ANDs it with the bits 0x06 of its timer's clock
// source: a wIndex of 1 would stop the timer.
constexpr std::uint16_t start_index = 0xff;
constexpr std::uint16_t stop_index = 0;

// A transfer is longer than any frame, so that a frame's short packet ends every transfer.
constexpr std::size_t transfer_packets = 8;
static_assert(transfer_packets * packet_bytes > 4 * rows * columns);

/// What a board tells of itself, before its interface is claimed.
struct Setup {
  SensorDescription description;
  std::vector<Calibration> calibrations;  ///< [e]
};

/// @throws Error
Setup read_setup(UsbHandle& handle) {
  Setup setup;
  const std::vector<Cell> cells =
      parse_alive_map(handle.control_in(request_alive_map, alive_map_request_bytes));
  for (const Cell& cell : cells) {
    setup.calibrations.push_back(parse_calibration(handle.control_in(
        request_calibration, calibration_bytes, static_cast<std::uint16_t>(cell.column),
        static_cast<std::uint16_t>(cell.row))));
  }
  // The rate is unknown: the period begins only after all cells are read, which takes longer.
  setup.description = {.name = "TakkTile",
                       .serial = handle.device().serial,
                       .pressure_unit = "kPa",
                       .elements_mm = element_positions(cells)};
  return setup;
}

/// A TakkTile whose interface is claimed and whose calibration is read: barometers under rubber, in
/// strips of five, which answer USB vendor requests. Between begin() and end() the link holds the
/// board's stream. Use it from one thread.
class Link {
 public:
  /// The context and the counters must outlive the link. @throws Error
  Link(const UsbContext& context, const ListedDevice& device, SensorCounters& counters)
      : context_(context),
        counters_(counters),
        handle_(context, device),
        setup_((handle_.claim(usb_interface), read_setup(handle_))),
        deframer_(setup_.calibrations, counters.garbage_bytes) {}

  const SensorDescription& description() const { return setup_.description; }

  /// Starts the stream. @throws Error
  void begin() {
    deframer_.reset();
    // The ring must be ready before the board sends.
    ring_.emplace(context_, handle_, usb_endpoint, transfer_packets * packet_bytes, counters_);
    try {
      handle_.control_in(request_stream, stream_reply_bytes, default_period_ticks, start_index);
    } catch (...) {
      ring_.reset();
      throw;
    }
  }

  /// Ends the stream and frees the ring. Returns the transfers not yet taken from the ring.
  std::vector<TransferRing::Completion> end() {
    try {
      handle_.control_in(request_stream, stream_reply_bytes, 0, stop_index);
    } catch (const Error&) {
      // The board may be unplugged; the transfers and interfaces are released either way.
    }
    ring_->drain();
    std::vector<TransferRing::Completion> last = ring_->completed();
    ring_.reset();
    return last;
  }

  /// The ring of the running stream.
  TransferRing& ring() { return *ring_; }
  Deframer& deframer() { return deframer_; }

 private:
  const UsbContext& context_;
  SensorCounters& counters_;
  UsbHandle handle_;
  Setup setup_;
  Deframer deframer_;
  std::optional<TransferRing> ring_;
};

}  // namespace

}  // namespace takktile

namespace {

// Longest wait for events, and so between two looks for a board that is gone: stop() interrupts it,
// but an interrupt may be missed.
constexpr suseconds_t event_patience_us = 100'000;

/// The board came back with other elements, so that the stream cannot continue.
class OtherElements : public Error {
 public:
  using Error::Error;
};

void handle_events(const UsbContext& context) {
  timeval patience{.tv_sec = 0, .tv_usec = event_patience_us};
  libusb_handle_events_timeout_completed(context.get(), &patience, nullptr);
}

std::vector<ListedDevice> boards() { return with_id(usb_devices(), {takktile::usb_id}); }

/// A sensor that streams from a TakkTile, also after it was unplugged and plugged in again.
///
/// Its thread handles libusb's events, decodes transfers, ends stalls and waits for an unplugged
/// board.
class TakktileSensor final : public QueuedSensor {
 public:
  /// @param which serial number or port of the board; "" if only one is plugged in. @throws Error
  explicit TakktileSensor(const std::string& which) {
    const std::vector<ListedDevice> listed = boards();
    const ListedDevice device = choose_device(listed, takktile_kind, which);
    which_ = distinction(device, listed);
    link_ = std::make_unique<takktile::Link>(context_, device, tally_);
    description_ = link_->description();
  }

  ~TakktileSensor() override { stop(); }

  void start() override {
    stop();
    forget();
    tally_ = {};
    begin();
    gone_ = false;
    stopping_ = false;
    thread_ = std::thread([this] { run(); });
  }

  bool gone() const override { return gone_; }

  void stop() override {
    if (thread_.joinable()) {
      stopping_ = true;
      libusb_interrupt_event_handler(context_.get());
      thread_.join();
    }
  }

 private:
  void begin() {
    if (link_) {
      try {
        link_->begin();
        return;
      } catch (const Error&) {
        // A board that was unplugged since is a new device to the kernel, and must be opened again.
        link_.reset();
      }
    }
    reconnect();
  }

  void run() {
    try {
      while (!stopping_) {
        if (link_) {
          stream();
        } else {
          wait_for_return();
        }
        publish(tally_);
      }
      if (link_) {
        deliver(link_->end());
        publish(tally_);
      }
    } catch (...) {
      link_.reset();
      fail();
    }
  }

  void stream() {
    handle_events(context_);
    TransferRing& ring = link_->ring();
    deliver(ring.completed());
    if (ring.lost()) {
      let_go();
    } else if (ring.halted()) {
      try {
        ring.recover();
      } catch (const Error&) {
        let_go();
      }
    }
  }

  void let_go() {
    link_.reset();
    gone_ = true;
  }

  void wait_for_return() {
    handle_events(context_);
    if (stopping_) {
      return;
    }
    try {
      reconnect();
    } catch (const OtherElements&) {
      throw;
    } catch (const Error&) {
      return;  // not plugged in yet, or udev has not given permission yet, or gone again
    }
    ++tally_.reconnects;
    gone_ = false;
  }

  void reconnect() {
    const ListedDevice device = choose_device(boards(), takktile_kind, which_);
    auto link = std::make_unique<takktile::Link>(context_, device, tally_);
    const std::size_t elements = link->description().elements_mm.size();
    if (link->description().elements_mm != description_.elements_mm) {
      throw OtherElements(
          Fault::system,
          fmt::format(
              "{}: came back with {} elements instead of {}, or at other positions; open it again",
              device.place(), elements, description_.elements_mm.size()));
    }
    link->begin();
    link_ = std::move(link);
  }

  void deliver(const std::vector<TransferRing::Completion>& completions) {
    const auto lose_frames = [this](std::uint64_t frames) {
      lose(frames);
      tally_.lost += frames;
    };
    for (const TransferRing::Completion& completion : completions) {
      if (completion.missing > 0) {
        // A lower bound: each missing transfer held at least part of a frame.
        link_->deframer().reset();
        lose_frames(completion.missing);
      }
      // A transfer that was given up may end with a packet that is not full, too.
      const bool ended = completion.ended || completion.bytes.size() % takktile::packet_bytes != 0;
      if (auto frame = link_->deframer().push(completion.bytes, ended)) {
        push(std::move(*frame), completion.host_time_s);
      } else if (ended && !completion.bytes.empty()) {
        lose_frames(1);  // it has too few cells or too many
      }
    }
  }

  UsbContext context_;
  std::string which_;  // serial number or port, by which a board that comes back is known

  // Between start() and stop(), only the sensor's thread uses these.
  SensorCounters tally_;
  std::unique_ptr<takktile::Link> link_;  // none while the board is gone

  std::atomic<bool> stopping_ = false;
  std::atomic<bool> gone_ = false;
};

}  // namespace

SensorDescription describe_takktile(const ListedDevice& device) {
  const UsbContext context;
  UsbHandle handle(context, device);
  return takktile::read_setup(handle).description;
}

std::unique_ptr<Sensor> open_takktile(const std::string& which) {
  return std::make_unique<TakktileSensor>(which);
}

}  // namespace palpate
