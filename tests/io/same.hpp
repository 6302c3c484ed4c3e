#pragma once

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "palpate/touch.hpp"

namespace palpate {

/// The bits of the numbers of a list of numbers, points or poses; those of every NaN are the same.
template <typename Value>
std::vector<std::uint64_t> bits_of(const std::vector<Value>& list) {
  using Numbers = std::array<double, sizeof(Value) / sizeof(double)>;
  std::vector<std::uint64_t> bits;
  for (const Value& value : list) {
    for (const double number : std::bit_cast<Numbers>(value)) {
      bits.push_back(std::bit_cast<std::uint64_t>(
          std::isnan(number) ? std::numeric_limits<double>::quiet_NaN() : number));
    }
  }
  return bits;
}

/// All but the path, and whether the file was closed.
inline void expect_same(const Recording& read, const Recording& written) {
  for (const auto text : {&Recording::object, &Recording::sensor, &Recording::serial,
                          &Recording::pressure_unit, &Recording::rows}) {
    EXPECT_EQ(read.*text, written.*text);
  }
  EXPECT_EQ(read.valid, written.valid);
  EXPECT_EQ(read.lost_before, written.lost_before);
  for (const auto list : {&Recording::pressure, &Recording::time_s, &Recording::baseline,
                          &Recording::device_time_s}) {
    EXPECT_EQ(bits_of(read.*list), bits_of(written.*list));
  }
  EXPECT_EQ(bits_of(read.elements_mm), bits_of(written.elements_mm));
  EXPECT_EQ(bits_of(read.T_robot_sensor), bits_of(written.T_robot_sensor));
  ASSERT_EQ(read.truth.has_value(), written.truth.has_value());
  if (read.truth) {
    EXPECT_EQ(read.truth->object, written.truth->object);
    EXPECT_EQ(bits_of(std::vector{read.truth->T_object_robot}),
              bits_of(std::vector{written.truth->T_object_robot}));
  }
}

}  // namespace palpate
