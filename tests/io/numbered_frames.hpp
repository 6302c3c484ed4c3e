#pragma once

#include <cstddef>

#include "palpate/sensor.hpp"
#include "palpate/touch.hpp"
#include "same.hpp"
#include "support/limits.hpp"

namespace palpate {

inline constexpr double frame_rate_hz = 1000.0;

inline SensorDescription sensor_of(std::size_t elements) {
  SensorDescription sensor{.name = "Test", .serial = "7"};
  for (std::size_t i = 0; i < elements; ++i) {
    sensor.elements_mm.emplace_back(static_cast<double>(i), -0.5);
  }
  return sensor;
}

/// Its numbers say where they stand, and float32 holds them exactly. Every other frame has a pose;
/// before some, others were lost.
inline Frame frame_of(std::size_t i, std::size_t elements) {
  const auto number = static_cast<double>(i);
  Frame frame{.host_time_s = 1.7e9 + number / frame_rate_hz,
              .device_time_s = number,
              .values = {},
              .lost_before = i % 7 == 6 ? 2U : 0U};
  if (i % 2 == 0) {
    frame.T_robot_sensor = Pose{{number, 0.25}, -9.0};
  }
  for (std::size_t k = 0; k < elements; ++k) {
    frame.values.push_back(number + static_cast<double>(k) / 64.0);
  }
  return frame;
}

/// The recording holds the first frames of the stream, as they were, whatever its array's state.
inline void expect_prefix(const Recording& recording, std::size_t elements) {
  const SensorDescription sensor = sensor_of(elements);
  Recording expected;
  expected.rows = "frames";
  expected.sensor = sensor.name;
  expected.serial = sensor.serial;
  expected.elements_mm = sensor.elements_mm;
  expected.valid = recording.valid;
  expected.baseline = recording.baseline;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Frame frame = frame_of(i, elements);
    expected.time_s.push_back(frame.host_time_s);
    expected.device_time_s.push_back(*frame.device_time_s);
    expected.lost_before.push_back(frame.lost_before);
    expected.T_robot_sensor.push_back(frame.T_robot_sensor.value_or(Pose{{nan, nan}, nan}));
    expected.pressure.insert(expected.pressure.end(), frame.values.begin(), frame.values.end());
  }
  expect_same(recording, expected);
}

}  // namespace palpate
