#pragma once

namespace palpate {

/// A number as two floats, high + low, as the kernels keep their long sums.
struct TwoFloat {
  float high = 0.0F;
  float low = 0.0F;
  double value() const { return static_cast<double>(high) + low; }
};

}  // namespace palpate
