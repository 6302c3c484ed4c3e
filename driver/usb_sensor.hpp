#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "driver/board.hpp"
#include "driver/board_link.hpp"
#include "driver/frame_queue.hpp"
#include "driver/transfer_ring.hpp"
#include "driver/usb_device.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// A sensor that streams from a USB board, also after the board was unplugged and plugged in again.
///
/// Between start() and stop(), a thread of the sensor's own uses the device: it handles libusb's
/// events, decodes transfers, ends stalls and waits for an unplugged board. It passes frames to
/// next() through a queue.
class UsbSensor final : public Sensor {
 public:
  /// @param which serial number or port of the board; "" if only one is plugged in. @throws Error
  UsbSensor(std::unique_ptr<Board> board, const std::string& which);
  ~UsbSensor() override;
  UsbSensor(const UsbSensor&) = delete;
  UsbSensor& operator=(const UsbSensor&) = delete;

  const SensorDescription& description() const override { return description_; }
  void start() override;
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool gone() const override { return gone_; }
  void stop() override;
  SensorCounters counters() const override;

 private:
  void watch_arrivals();
  void begin();
  void run();
  void stream();
  void lose();
  void wait_for_return();
  void reconnect();
  void deliver(const std::vector<TransferRing::Completion>& completions);
  void publish();

  UsbContext context_;
  std::unique_ptr<Board> board_;
  std::string which_;  // serial number or port, by which a board that comes back is known
  std::atomic<bool> arrived_ = false;  // a device was plugged in

  // Between start() and stop(), only the sensor's thread uses these.
  TransferRing::Counters transfer_counters_;
  SensorCounters tally_;
  std::unique_ptr<BoardLink> link_;  // none while the board is gone
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

}  // namespace palpate
