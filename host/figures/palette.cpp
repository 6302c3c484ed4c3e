#include "figures/palette.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace palpate {

namespace {

double srgb_component(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055;
}

/// Oklab (Ottosson 2020) in polar coordinates: equal steps of lightness look equal.
Colour from_oklch(double lightness, double chroma, double hue_deg) {
  const double hue = hue_deg * std::numbers::pi / 180.0;
  const double a = chroma * std::cos(hue);
  const double b = chroma * std::sin(hue);
  const auto cube = [](double v) { return v * v * v; };
  const double l = cube(lightness + 0.3963377774 * a + 0.2158037573 * b);
  const double m = cube(lightness - 0.1055613458 * a - 0.0638541728 * b);
  const double s = cube(lightness - 0.0894841775 * a - 1.2914855480 * b);
  return {srgb_component(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          srgb_component(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          srgb_component(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

}  // namespace

Colour diverging(double t) {
  if (std::isnan(t)) {
    return white;
  }
  const double strength = std::min(std::abs(t), 1.0);
  // The chroma follows the sRGB gamut, which narrows towards white.
  const double chroma = 0.145 * strength * (2.0 - strength);
  return from_oklch(1.0 - 0.6 * strength, chroma, t < 0.0 ? 253.0 : 26.0);
}

Colour sequential(double t) {
  const double v = std::isnan(t) ? 0.0 : std::clamp(t, 0.0, 1.0);
  return from_oklch(0.2 + 0.73 * v, 0.09 + 0.07 * v * v, 305.0 - 200.0 * v);
}

Colour series(std::size_t i) {
  static constexpr std::array<Colour, series_colours> okabe_ito{{
      {0.000, 0.447, 0.698},  // blue
      {0.835, 0.369, 0.000},  // vermillion
      {0.000, 0.620, 0.451},  // bluish green
      {0.800, 0.475, 0.655},  // reddish purple
      {0.902, 0.624, 0.000},  // orange
      {0.337, 0.706, 0.914},  // sky blue
      {0.000, 0.000, 0.000},
  }};
  return okabe_ito[i];
}

}  // namespace palpate
