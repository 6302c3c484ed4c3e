#pragma once

#include <memory>
#include <optional>
#include <string>

#include "driver/board.hpp"
#include "driver/serial_profile.hpp"

namespace palpate {

/// A board behind a USB serial port (CDC ACM) that a profile describes.
class SerialBoard final : public Board {
 public:
  SerialBoard(std::string name, SerialProfile profile);

  const std::string& name() const override { return name_; }
  bool has_ids() const override { return !profile_.usb.empty(); }
  bool fits(const UsbDevice& device) const override;
  StreamSource source(const UsbDevice& device) const override;
  SensorDescription configure(UsbHandle& handle) override;
  void start(UsbHandle& handle) override;
  void stop(UsbHandle& handle) override;
  Deframer& deframer() override { return *deframer_; }

 private:
  void send(UsbHandle& handle, const std::vector<std::uint8_t>& bytes);

  std::string name_;
  SerialProfile profile_;
  std::unique_ptr<Deframer> deframer_;
};

}  // namespace palpate
