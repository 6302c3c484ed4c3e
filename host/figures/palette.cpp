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

/// A scale of colours over [0, 1], between shades that are computed once: a picture asks for a
/// hundred thousand.
class Shades {
 public:
  template <typename ColourAt>
  explicit Shades(const ColourAt& colour_at) {
    for (std::size_t k = 0; k <= steps; ++k) {
      shades_[k] = colour_at(static_cast<double>(k) / steps);
    }
  }

  Colour at(double t) const {
    const auto k = std::min(static_cast<std::size_t>(t * steps), steps - 1);
    const double part = t * steps - static_cast<double>(k);
    const auto mix = [part](double a, double b) { return a + part * (b - a); };
    const Colour& a = shades_[k];
    const Colour& b = shades_[k + 1];
    return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue)};
  }

 private:
  static constexpr std::size_t steps = 1024;
  std::array<Colour, steps + 1> shades_;
};

/// A half of the diverging scale.
Shades half_scale(double hue_deg) {
  return Shades([hue_deg](double strength) {
    // The chroma follows the sRGB gamut, which narrows towards white.
    const double chroma = 0.145 * strength * (2.0 - strength);
    return from_oklch(1.0 - 0.6 * strength, chroma, hue_deg);
  });
}

}  // namespace

Colour diverging(double t) {
  if (std::isnan(t)) {
    return white;
  }
  static const Shades blue = half_scale(253.0);
  static const Shades red = half_scale(26.0);
  return (t < 0.0 ? blue : red).at(std::min(std::abs(t), 1.0));
}

Colour sequential(double t) {
  static const Shades scale(
      [](double v) { return from_oklch(0.2 + 0.73 * v, 0.09 + 0.07 * v * v, 305.0 - 200.0 * v); });
  return scale.at(std::isnan(t) ? 0.0 : std::clamp(t, 0.0, 1.0));
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
