#pragma once

#include <memory>
#include <string>
#include <vector>

#include "driver/board.hpp"
#include "driver/takktile_protocol.hpp"

namespace palpate {

/// A TakkTile: barometers under rubber, in strips of five, which answer USB vendor requests.
class TakktileBoard final : public Board {
 public:
  static inline const std::string kind = "takktile";

  const std::string& name() const override { return kind; }
  bool fits(const UsbDevice& device) const override;
  StreamSource source(const UsbDevice& device) const override;
  SensorDescription configure(UsbHandle& handle) override;
  void start(UsbHandle& handle) override;
  void stop(UsbHandle& handle) override;
  Deframer& deframer() override { return *deframer_; }
  std::uint64_t parse(const TransferRing::Completion& completion,
                      std::vector<ParsedFrame>& frames) override;

 private:
  std::unique_ptr<takktile::Deframer> deframer_;
};

}  // namespace palpate
