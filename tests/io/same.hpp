#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The same bits, or both no number.
inline bool same(double a, double b) {
  return std::isnan(a) ? std::isnan(b)
                       : std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

inline bool same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b, [](double x, double y) { return same(x, y); });
}

inline bool same(const Pose& a, const Pose& b) {
  return same(a.translation_mm.x, b.translation_mm.x) &&
         same(a.translation_mm.y, b.translation_mm.y) && same(a.theta_rad, b.theta_rad);
}

inline bool same(const std::optional<Truth>& a, const std::optional<Truth>& b) {
  return a.has_value() == b.has_value() &&
         (!a || (a->object == b->object && same(a->T_object_robot, b->T_object_robot)));
}

inline bool same(const Axis& a, const Axis& b) {
  return same(a.lower, b.lower) && same(a.upper, b.upper) && a.count == b.count;
}

/// All but the path, and whether the file was closed.
inline void expect_same(const Recording& read, const Recording& written) {
  const auto exact = [](const Recording& r) {
    return std::tie(r.object, r.sensor, r.serial, r.pressure_unit, r.rows, r.valid, r.time_s,
                    r.lost_before);
  };
  EXPECT_EQ(exact(read), exact(written));
  EXPECT_EQ(read.elements_mm, written.elements_mm);
  EXPECT_TRUE(same(read.pressure, written.pressure));
  EXPECT_TRUE(same(read.baseline, written.baseline));
  EXPECT_TRUE(same(read.device_time_s, written.device_time_s));
  EXPECT_TRUE(same(read.truth, written.truth));
  EXPECT_TRUE(std::ranges::equal(read.T_robot_sensor, written.T_robot_sensor,
                                 [](const Pose& a, const Pose& b) { return same(a, b); }));
}

}  // namespace palpate
