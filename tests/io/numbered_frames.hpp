#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>

#include "palpate/sensor.hpp"
#include "palpate/touch.hpp"

namespace palpate {

inline constexpr double frame_rate_hz = 1000.0;
inline constexpr double first_frame_s = 1.7e9;

inline SensorDescription sensor_of(std::size_t elements) {
  SensorDescription sensor{.name = "Test", .serial = "7"};
  for (std::size_t i = 0; i < elements; ++i) {
    sensor.elements_mm.emplace_back(static_cast<double>(i), -0.5);
  }
  return sensor;
}

/// Numbers that say where they stand, and that float32 holds exactly.
inline double reading(std::size_t frame, std::size_t element) {
  return static_cast<double>(frame % 65536) + static_cast<double>(element) / 64.0;
}

/// Every other frame has a pose; before some, others were lost.
inline Frame frame_of(std::size_t i, std::size_t elements) {
  const auto number = static_cast<double>(i);
  Frame frame{.host_time_s = first_frame_s + number / frame_rate_hz,
              .device_time_s = number,
              .values = {},
              .lost_before = i % 7 == 6 ? 2U : 0U};
  if (i % 2 == 0) {
    frame.T_robot_sensor = Pose{{number, 0.25}, -9.0};
  }
  for (std::size_t k = 0; k < elements; ++k) {
    frame.values.push_back(reading(i, k));
  }
  return frame;
}

/// The recording holds the first frames of the stream, as they were.
inline void expect_prefix(const Recording& recording, std::size_t elements) {
  EXPECT_EQ(recording.rows, "frames");
  EXPECT_EQ(recording.sensor, "Test");
  EXPECT_EQ(recording.serial, "7");
  ASSERT_EQ(recording.elements(), elements);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    const Frame frame = frame_of(i, elements);
    ASSERT_EQ(recording.time_s[i], frame.host_time_s) << i;
    ASSERT_EQ(recording.device_time_s[i], frame.device_time_s) << i;
    ASSERT_EQ(recording.lost_before[i], frame.lost_before) << i;
    const Pose& pose = recording.T_robot_sensor[i];
    ASSERT_EQ(std::isnan(pose.theta_rad), !frame.T_robot_sensor) << i;
    if (frame.T_robot_sensor) {
      ASSERT_EQ(pose.translation_mm, frame.T_robot_sensor->translation_mm) << i;
      ASSERT_EQ(pose.theta_rad, frame.T_robot_sensor->theta_rad) << i;
    }
    for (std::size_t k = 0; k < elements; ++k) {
      ASSERT_EQ(recording.pressure[i * elements + k], frame.values[k]) << i;
    }
  }
}

}  // namespace palpate
