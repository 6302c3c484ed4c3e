#pragma once

#include <cstddef>

namespace palpate {

/// sRGB, each component in [0, 1].
struct Colour {
  double red = 0.0;
  double green = 0.0;
  double blue = 0.0;
  double alpha = 1.0;
};

inline constexpr Colour white{1.0, 1.0, 1.0};
inline constexpr Colour ink{0.13, 0.13, 0.13};
inline constexpr Colour grey{0.55, 0.55, 0.55};

/// Returns blue over white to red for t in [-1, 1], saturated beyond. Perceived lightness falls
/// linearly and equally on both sides with |t|, so that no colour-blind eye confuses weak with
/// strong. NaN is white.
Colour diverging(double t);

/// Returns dark violet over teal to yellow for t in [0, 1], saturated beyond. Perceived lightness
/// rises linearly with t. NaN is the dark end.
Colour sequential(double t);

/// The colours of Okabe and Ito (2008) that show on white, told apart by every common kind of
/// colour vision; i < series_colours.
inline constexpr std::size_t series_colours = 7;
Colour series(std::size_t i);

}  // namespace palpate
