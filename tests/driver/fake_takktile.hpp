#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "fake_usb_device.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// The pressure of a cell of the fake, in kPa, by the formula and the worked example's coefficients
/// of the MPL115A2's data sheet. Each recalibration of the fake adds 32 to a0.
double expected_kpa(int raw_pressure, int raw_temperature = 512, int recalibrations = 0);
/// The data sheet rounds the coefficients to 1e-6; readings of up to 1023 multiply them twice.
constexpr double kpa_tolerance = 0.05;

/// Takes `count` frames, each of as many cells, which read first_raw, first_raw + 1, ... from frame
/// to frame; returns them.
std::vector<Frame> expect_frames(Sensor& sensor, std::size_t cells, int first_raw,
                                 std::size_t count = 1, int recalibrations = 0);

/// A TakkTile as its published firmware behaves.
class FakeTakktile {
 public:
  /// The firmware that answers: its alive map has 8 bytes of bits, or 40 bytes.
  enum class Layout { bits, bytes };

  /// @param alive_rows [row] the cells that are alive, as bits
  FakeTakktile(FakeUsb& usb, const std::string& serial, std::vector<std::uint8_t> alive_rows,
               Layout layout = Layout::bits, int address = 2);

  /// Sends a frame in which every cell reads these 10-bit numbers.
  void send_frame(int raw_pressure, int raw_temperature = 512);
  /// Whether the host asked for frames.
  bool streaming() const { return streaming_; }
  int cells() const;
  /// Changes the calibration.
  void recalibrate() { ++recalibrations_; }
  /// Changes the cells that are alive.
  void replace_cells(std::vector<std::uint8_t> alive_rows);

  FakeUsbDevice& usb() { return device_; }

 private:
  std::optional<Bytes> answer(const FakeUsbDevice::Setup& setup);

  std::vector<std::uint8_t> alive_rows_;
  Layout layout_;
  std::atomic<bool> streaming_ = false;
  std::atomic<int> recalibrations_ = 0;
  FakeUsbDevice device_;  // last member: it calls functions that use the other members
};

}  // namespace palpate
