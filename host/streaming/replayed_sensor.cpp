#include "streaming/replayed_sensor.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "model/lost_count.hpp"
#include "model/stream_time.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate {

ReplayedSensor::ReplayedSensor(const std::string& path, std::optional<double> speed)
    : recording_(read_recording(path)), pace_(speed) {
  const auto refuse = [&](const char* message) {
    throw Error(Fault::input, fmt::format("{}: {}", path, message));
  };
  const Recording& r = recording_;
  if (r.rows != "frames") {
    refuse(
        "attribute 'rows' = 'touches' means single readings; give a stream of frames, or recognise "
        "the touches: palpate recognize");
  }
  if (r.time_s.empty()) {
    refuse("dataset 'time' is missing; a replay needs the times of the frames");
  }
  const std::size_t e = r.elements();
  if (r.elements_mm.size() != e) {
    refuse("dataset 'elements' changes from frame to frame; record each array to its own file");
  }
  description_.name = r.sensor;
  description_.serial = r.serial;
  description_.pressure_unit = r.pressure_unit;
  description_.elements_mm = r.elements_mm;
  // An element that is valid in no frame is dead.
  description_.valid.assign(r.valid.empty() ? 0 : e, 0);
  for (std::size_t i = 0; i < r.size(); ++i) {
    const Touch frame = r.touch(i);
    for (std::size_t k = 0; k < frame.valid.size(); ++k) {
      description_.valid[k] |= frame.valid[k];
    }
  }
  description_.baseline = r.baseline;
  description_.object = r.object;
  description_.truth = r.truth;
  StreamTime time;
  for (const double time_s : r.time_s) {
    time.advance(time_s);
  }
  if (time.elapsed_s() > 0.0) {
    description_.rate_hz = static_cast<double>(r.size() - 1) / time.elapsed_s();
  }
}

void ReplayedSensor::start() {
  at_ = 0;
  counters_ = {};
  pace_.start(recording_.time_s.front());
}

std::optional<Frame> ReplayedSensor::next(std::chrono::milliseconds timeout) {
  if (ended() || !pace_.wait(recording_.time_s[at_], timeout)) {
    return {};
  }
  const Recording& r = recording_;
  const std::size_t i = at_++;
  const Touch touch = r.touch(i);
  std::vector<double> values(touch.pressure.begin(), touch.pressure.end());
  if (r.valid.size() != r.elements()) {
    for (std::size_t k = 0; k < touch.valid.size(); ++k) {
      if (touch.valid[k] == 0) {
        values[k] = std::numeric_limits<double>::quiet_NaN();  // Unknown in this frame
      }
    }
  }
  Frame frame{.host_time_s = r.time_s[i],
              .values = std::move(values),
              .lost_before = r.lost_before.empty() ? 0 : r.lost_before[i]};
  if (!r.device_time_s.empty() && !std::isnan(r.device_time_s[i])) {
    frame.device_time_s = r.device_time_s[i];
  }
  if (!std::isnan(touch.T_robot_sensor.theta_rad)) {
    frame.T_robot_sensor = touch.T_robot_sensor;
  }
  ++counters_.frames;
  count_lost(counters_.lost, frame.lost_before);
  return frame;
}

}  // namespace palpate
