#pragma once

#include <optional>
#include <string>

#include "palpate/sensor.hpp"
#include "palpate/touch.hpp"
#include "streaming/pace.hpp"

namespace palpate {

/// Plays a recording of frames: see open_virtual_sensor().
class ReplayedSensor : public Sensor {
 public:
  /// @throws Error where the file is no recording of frames with times
  ReplayedSensor(const std::string& path, std::optional<double> speed);

  const SensorDescription& description() const override { return description_; }
  void start() override;
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool ended() const override { return at_ == recording_.size(); }
  void stop() override {}
  SensorCounters counters() const override { return counters_; }

 private:
  Recording recording_;
  SensorDescription description_;
  Pace pace_;
  std::size_t at_ = 0;  ///< index of the next frame
  SensorCounters counters_;
};

}  // namespace palpate
