#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "fake_usb_device.hpp"

namespace palpate {

/// What a cell of the fake reads, in kPa, by the formula of the MPL115A2's data sheet with the
/// coefficients of its worked example; a0 grows by 32 each time the fake is recalibrated.
double expected_kpa(int raw_pressure, int raw_temperature = 512, int recalibrations = 0);
/// The data sheet rounds the coefficients to 1e-6; they are multiplied by up to 1023 twice.
constexpr double kpa_tolerance = 0.05;

/// A TakkTile as its published firmware behaves.
class FakeTakktile {
 public:
  /// Which firmware answers: they tell the cells alive in 8 bytes of bits, or in 40 bytes.
  enum class Layout { bits, bytes };

  /// @param alive_rows cells of each row that are alive, as bits
  FakeTakktile(FakeUsb& usb, const std::string& serial, std::vector<std::uint8_t> alive_rows,
               Layout layout = Layout::bits, int address = 2);

  /// Sends a frame whose cells all read these 10-bit numbers.
  void send_frame(int raw_pressure, int raw_temperature = 512);
  /// The host has asked for frames.
  bool streaming() const { return streaming_; }
  int cells() const;
  /// Its calibration is another one from here on.
  void recalibrate() { ++recalibrations_; }
  /// Its cells are others from here on.
  void replace_cells(std::vector<std::uint8_t> alive_rows);

  FakeUsbDevice& usb() { return device_; }

 private:
  std::optional<Bytes> answer(const FakeUsbDevice::Setup& setup);

  std::vector<std::uint8_t> alive_rows_;
  Layout layout_;
  std::atomic<bool> streaming_ = false;
  std::atomic<int> recalibrations_ = 0;
  FakeUsbDevice device_;  // the last: it calls the others
};

}  // namespace palpate
