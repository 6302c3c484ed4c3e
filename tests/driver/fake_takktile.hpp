#pragma once

#include <atomic>
#include <bit>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "driver/takktile_protocol.hpp"
#include "fake_usb_device.hpp"
#include "streamed.hpp"

namespace palpate {

/// The calibration of every cell of the fake: the worked example of the MPL115A2's data sheet, to
/// whose a0 each recalibration adds 32.
inline Bytes calibration_after(int recalibrations) {
  return {
      static_cast<std::uint8_t>(0x3e + recalibrations), 0xce, 0xb3, 0xf9, 0xc5, 0x17, 0x33, 0xc8};
}

inline double expected_kpa(int raw_pressure, int raw_temperature = 512, int recalibrations = 0) {
  return takktile::pressure_kpa(takktile::parse_calibration(calibration_after(recalibrations)),
                                raw_pressure, raw_temperature);
}

/// Takes `count` frames, each of as many cells, which read first_raw, first_raw + 1, ... from frame
/// to frame; returns them.
inline std::vector<Frame> expect_frames(Sensor& sensor, std::size_t cells, int first_raw,
                                        std::size_t count = 1, int recalibrations = 0) {
  std::vector<Frame> frames = take(sensor, count);
  EXPECT_EQ(frames.size(), count);
  for (const Frame& frame : frames) {
    EXPECT_EQ(frame.values.size(), cells);
    for (const double value : frame.values) {
      EXPECT_EQ(value, expected_kpa(first_raw, 512, recalibrations));
    }
    ++first_raw;
  }
  return frames;
}

/// A TakkTile as its published firmware behaves.
class FakeTakktile {
 public:
  /// The firmware that answers: its alive map has 8 bytes of bits, or 40 bytes.
  enum class Layout { bits, bytes };

  /// @param alive_rows [row] the cells that are alive, as bits
  FakeTakktile(FakeUsb& usb, const std::string& serial, std::vector<std::uint8_t> alive_rows,
               Layout layout = Layout::bits, int address = 2)
      : alive_rows_(std::move(alive_rows)),
        layout_(layout),
        device_(usb, address,
                {.vendor = 0x59e3,
                 .product = 0x74c7,
                 .manufacturer = "TakkTile LLC",
                 .product_name = "TakkTile USB",
                 .serial = serial},
                configuration(),
                [this](const FakeUsbDevice::Setup& setup) { return answer(setup); }) {
    alive_rows_.resize(8);
  }

  /// Sends a frame in which every cell reads this 10-bit number, and 512 for the temperature.
  void send_frame(int raw_pressure) {
    Bytes frame;
    for (int cell = 0; cell < cells(); ++cell) {
      for (const int raw : {raw_pressure, 512}) {
        frame.push_back(static_cast<std::uint8_t>(raw >> 2));
        frame.push_back(static_cast<std::uint8_t>(raw << 6));
      }
    }
    device_.send(frame);
  }
  /// Whether the host asked for frames.
  bool streaming() const { return streaming_; }
  int cells() const {
    int cells = 0;
    for (const std::uint8_t row : alive_rows_) {
      cells += std::popcount(row);
    }
    return cells;
  }
  /// Changes the calibration.
  void recalibrate() { ++recalibrations_; }
  /// Changes the cells that are alive.
  void replace_cells(std::vector<std::uint8_t> alive_rows) {
    alive_rows_ = std::move(alive_rows);
    alive_rows_.resize(8);
  }

  FakeUsbDevice& usb() { return device_; }

 private:
  static constexpr int columns = 5;

  /// One vendor interface: bulk endpoint 0x81 towards the host, 0x02 from the host.
  static Bytes configuration() {
    return {9, 2, 32,   0, 1,  1,    0, 0x80, 50,  // one interface
            9, 4, 0,    0, 2,  0xff, 0, 0,    0,   //
            7, 5, 0x81, 2, 64, 0,    0,            //
            7, 5, 0x02, 2, 64, 0,    0};
  }
  std::optional<Bytes> answer(const FakeUsbDevice::Setup& setup) {
    if (setup.type != 0xc0) {
      return std::nullopt;
    }
    switch (setup.request) {
      case 0x5c: {
        if (layout_ == Layout::bits) {
          return alive_rows_;
        }
        Bytes map;
        for (const std::uint8_t row : alive_rows_) {
          for (int column = 0; column < columns; ++column) {
            map.push_back((row >> column & 1) != 0 ? 0xff : 0x00);
          }
        }
        return map;
      }
      case 0x6c:
        return calibration_after(recalibrations_);
      case 0xc7: {
        // TCC0.CTRLA = TC_CLKSEL_DIV256_gc & wIndex: the timer runs if a bit of 0x06 is set.
        constexpr int clock_by_256 = 0x06;
        streaming_ = (setup.index & clock_by_256) == clock_by_256;
        return Bytes{static_cast<std::uint8_t>(setup.index != 0 ? 1 : 0)};
      }
      default:
        return std::nullopt;
    }
  }

  std::vector<std::uint8_t> alive_rows_;
  Layout layout_;
  std::atomic<bool> streaming_ = false;
  std::atomic<int> recalibrations_ = 0;
  FakeUsbDevice device_;  // last member: it calls functions that use the other members
};

}  // namespace palpate
