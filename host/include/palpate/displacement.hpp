#pragma once

namespace palpate {

/// Standard deviations of a small displacement in the plane: of x and of y, in mm, and of the
/// angle, in radians. All three are independent and normally distributed about 0.
struct DisplacementSd {
  double mm = 0.0;
  double rad = 0.0;

  /// True where nothing is ever displaced.
  bool none() const { return mm == 0.0 && rad == 0.0; }
};

}  // namespace palpate
