#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "driver/frame_queue.hpp"
#include "driver/open_sensor.hpp"
#include "driver/serial_profile.hpp"
#include "driver/takktile_link.hpp"
#include "driver/transfer_ring.hpp"
#include "palpate/error.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

namespace {

using std::chrono::duration_cast;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Waits between two looks for a board that is gone: short at first, as udev needs a moment to grant
// permission; longer later, as the board may never come back.
constexpr milliseconds first_back_off{50};
constexpr milliseconds longest_back_off{1000};
// Longest wait for events: stop() interrupts it, but an interrupt may be missed.
constexpr milliseconds event_patience{100};

/// The board came back with other elements, so that the stream cannot continue.
class OtherElements : public Error {
 public:
  using Error::Error;
};

void handle_events(const UsbContext& context, microseconds patience) {
  timeval time{.tv_sec = patience.count() / 1'000'000, .tv_usec = patience.count() % 1'000'000};
  libusb_handle_events_timeout_completed(context.get(), &time, nullptr);
}

int on_arrival(libusb_context*, libusb_device*, libusb_hotplug_event, void* arrived) noexcept {
  static_cast<std::atomic<bool>*>(arrived)->store(true);
  return 0;  // stay registered
}

std::vector<ListedDevice> boards() { return with_id(usb_devices(), {takktile::usb_id}); }

/// A sensor that streams from a TakkTile, also after it was unplugged and plugged in again.
///
/// Between start() and stop(), a thread of the sensor's own uses the device: it handles libusb's
/// events, decodes transfers, ends stalls and waits for an unplugged board. It passes frames to
/// next() through a queue.
class TakktileSensor final : public Sensor {
 public:
  /// @param which serial number or port of the board; "" if only one is plugged in. @throws Error
  explicit TakktileSensor(const std::string& which) {
    const std::vector<ListedDevice> listed = boards();
    const ListedDevice device = choose_device(listed, takktile_kind, which);
    which_ = distinction(device, listed);
    link_ = std::make_unique<takktile::Link>(context_, device, transfer_counters_);
    description_ = link_->description();
    watch_arrivals();
  }

  ~TakktileSensor() override { stop(); }

  TakktileSensor(const TakktileSensor&) = delete;
  TakktileSensor& operator=(const TakktileSensor&) = delete;

  const SensorDescription& description() const override { return description_; }

  void start() override {
    stop();
    queue_.clear();
    transfer_counters_ = {};
    tally_ = {};
    lost_before_next_ = 0;
    publish();
    begin();
    gone_ = false;
    stopping_ = false;
    back_off_ = first_back_off;
    thread_ = std::thread([this] { run(); });
  }

  std::optional<Frame> next(std::chrono::milliseconds timeout) override {
    return queue_.pop(timeout);
  }

  bool gone() const override { return gone_; }

  void stop() override {
    if (thread_.joinable()) {
      stopping_ = true;
      libusb_interrupt_event_handler(context_.get());
      thread_.join();
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
  void watch_arrivals() {
    // Without hotplug events, wait_for_return() finds the board by looking at intervals.
    if (libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) != 0) {
      libusb_hotplug_register_callback(context_.get(), LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED,
                                       LIBUSB_HOTPLUG_NO_FLAGS, LIBUSB_HOTPLUG_MATCH_ANY,
                                       LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY,
                                       on_arrival, &arrived_, nullptr);
    }
  }

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
        publish();
      }
      if (link_) {
        deliver(link_->end());
        publish();
      }
    } catch (...) {
      link_.reset();
      queue_.fail(std::current_exception());
    }
  }

  void stream() {
    handle_events(context_, event_patience);
    TransferRing& ring = link_->ring();
    std::vector<TransferRing::Completion> completions = ring.completed();
    deliver(completions);
    ring.recycle(std::move(completions));
    if (ring.lost()) {
      lose();
    } else if (ring.halted()) {
      try {
        ring.recover();
      } catch (const Error&) {
        lose();
      }
    }
  }

  void lose() {
    link_.reset();
    gone_ = true;
  }

  void wait_for_return() {
    const auto end = steady_clock::now() + back_off_;
    for (auto now = steady_clock::now(); !stopping_ && !arrived_ && now < end;
         now = steady_clock::now()) {
      handle_events(context_,
                    std::min<microseconds>(duration_cast<microseconds>(end - now), event_patience));
    }
    back_off_ =
        arrived_.exchange(false) ? first_back_off : std::min(2 * back_off_, longest_back_off);
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
    auto link = std::make_unique<takktile::Link>(context_, device, transfer_counters_);
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
    Deframer& deframer = link_->deframer();
    for (const TransferRing::Completion& completion : completions) {
      if (completion.missing > 0) {
        // A lower bound: each missing transfer held at least part of a frame.
        deframer.reset();
        lost_before_next_ += completion.missing;
        tally_.lost += completion.missing;
      }
      const std::uint64_t garbage_before = deframer.counters().garbage_bytes;
      parsed_.clear();
      const std::uint64_t spoiled = link_->parse(completion, parsed_);
      tally_.garbage_bytes += deframer.counters().garbage_bytes - garbage_before;
      tally_.lost += spoiled;
      lost_before_next_ += spoiled;
      for (ParsedFrame& frame : parsed_) {
        queue_.push({.host_time_s = completion.host_time_s,
                     .device_time_s = frame.device_time_s,
                     .values = std::move(frame.values),
                     .lost_before = std::exchange(lost_before_next_, 0)});
        back_off_ = first_back_off;
      }
    }
  }

  void publish() {
    const std::lock_guard lock(mutex_);
    published_ = tally_;
    published_.timeouts = transfer_counters_.timeouts;
    published_.stalls = transfer_counters_.stalls;
    published_.overflows = transfer_counters_.overflows;
  }

  UsbContext context_;
  std::string which_;  // serial number or port, by which a board that comes back is known
  std::atomic<bool> arrived_ = false;  // a device was plugged in

  // Between start() and stop(), only the sensor's thread uses these.
  TransferRing::Counters transfer_counters_;
  SensorCounters tally_;
  std::unique_ptr<takktile::Link> link_;  // none while the board is gone
  std::vector<ParsedFrame> parsed_;
  std::uint64_t lost_before_next_ = 0;
  std::chrono::milliseconds back_off_ = {};

  SensorDescription description_;
  std::thread thread_;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> gone_ = false;
  FrameQueue queue_;
  mutable std::mutex mutex_;
  SensorCounters published_;  // copy of tally_ for counters(), guarded by mutex_
};

}  // namespace

std::unique_ptr<Sensor> open_takktile(const std::string& which) {
  return std::make_unique<TakktileSensor>(which);
}

}  // namespace palpate
