#include "figures/palette.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "picture.hpp"
#include "support/limits.hpp"

namespace palpate::palette_test {

/// Relative luminance of an sRGB colour (IEC 61966-2-1).
double luminance(const Colour& c) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.red) + 0.7152 * linear(c.green) + 0.0722 * linear(c.blue);
}

/// CIE 1976 lightness, 0 to 100.
double lightness(const Colour& c) { return 116.0 * std::cbrt(luminance(c)) - 16.0; }

TEST(Palette, DivergingIsWhiteInTheMiddleBlueBelowAndRedAbove) {
  EXPECT_EQ(rgb(diverging(0.0)), 0xFFFFFFu);
  EXPECT_NE(rgb(diverging(0.02)), 0xFFFFFFu);
  EXPECT_NE(rgb(diverging(-0.02)), 0xFFFFFFu);
  for (double t = 0.1; t <= 1.0; t += 0.1) {
    EXPECT_GT(diverging(t).red, diverging(t).blue) << t;
    EXPECT_GT(diverging(-t).blue, diverging(-t).red) << t;
  }
}

TEST(Palette, DivergingDarkensEvenlyAndEquallyOnBothSides) {
  double before = lightness(diverging(0.0));
  for (int k = 1; k <= 50; ++k) {
    const double positive = lightness(diverging(k / 50.0));
    const double negative = lightness(diverging(-k / 50.0));
    EXPECT_LT(positive, before);
    // Two measures of lightness, Oklab's and CIE's, differ for saturated colours; 8 of 100 is a
    // difference that no one reads as a different strength.
    EXPECT_NEAR(positive, negative, 8.0) << k;
    before = positive;
  }
}

TEST(Palette, SequentialBrightensAtEveryStep) {
  double before = -1.0;
  for (int k = 0; k <= 100; ++k) {
    const double now = lightness(sequential(k / 100.0));
    // A hundredth of the 80 units from end to end is 0.8; no step may be lost or doubled.
    if (k > 0) {
      EXPECT_GT(now - before, 0.3) << k;
      EXPECT_LT(now - before, 1.6) << k;
    }
    before = now;
  }
}

TEST(Palette, SaturatesBeyondItsRange) {
  EXPECT_EQ(rgb(diverging(infinity)), rgb(diverging(1.0)));
  EXPECT_EQ(rgb(diverging(-infinity)), rgb(diverging(-1.0)));
  EXPECT_EQ(rgb(diverging(nan)), rgb(diverging(0.0)));
  EXPECT_EQ(rgb(sequential(infinity)), rgb(sequential(1.0)));
  EXPECT_EQ(rgb(sequential(-infinity)), rgb(sequential(0.0)));
  EXPECT_EQ(rgb(sequential(nan)), rgb(sequential(0.0)));
}

TEST(Palette, SeriesColoursDifferAndShowOnWhite) {
  for (std::size_t i = 0; i < series_colours; ++i) {
    // 1.9 : 1 is the contrast of the lightest of them, enough for a line 3 pixels wide.
    EXPECT_GT(1.05 / (luminance(series(i)) + 0.05), 1.9) << i;
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_NE(rgb(series(i)), rgb(series(k)));
    }
  }
}

}  // namespace palpate::palette_test
