#pragma once

#include "palpate/pose.hpp"

namespace palpate {

/// The pose that lies a part of the way from `a` to `b`: on the line between them, by the shorter
/// turn. @param part from 0 to 1
inline Pose between(const Pose& a, const Pose& b, double part) {
  return {a.translation_mm + part * (b.translation_mm - a.translation_mm),
          a.theta_rad + part * wrap_angle(b.theta_rad - a.theta_rad)};
}

}  // namespace palpate
