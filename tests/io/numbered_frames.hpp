#pragma once

#include <gtest/gtest.h>

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

inline Frame frame_of(std::size_t i, std::size_t elements) {
  Frame frame{.host_time_s = first_frame_s + static_cast<double>(i) / frame_rate_hz, .values = {}};
  for (std::size_t k = 0; k < elements; ++k) {
    frame.values.push_back(reading(i, k));
  }
  return frame;
}

/// The recording holds the first frames of the stream, as they were.
inline void expect_prefix(const Recording& recording, std::size_t elements) {
  EXPECT_EQ(recording.rows, "frames");
  ASSERT_EQ(recording.elements(), elements);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    ASSERT_EQ(recording.time_s[i], first_frame_s + static_cast<double>(i) / frame_rate_hz) << i;
    for (std::size_t k = 0; k < elements; ++k) {
      ASSERT_EQ(recording.pressure[i * elements + k], reading(i, k)) << i;
    }
  }
}

}  // namespace palpate
