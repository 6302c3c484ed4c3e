#include "figures/canvas.hpp"

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "figures/palette.hpp"
#include "picture.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::canvas_test {

TEST(Canvas, FillsCellsFromTheLowestRowUpAndRefusesASizeBeyondCairo) {
  error_of(Fault::system, [] { Canvas(100000, 10); });
  constexpr int nx = 4;
  constexpr int ny = 3;
  const auto colour = [](int i, int j) { return Colour{i / 3.0, j / 2.0, 0.2}; };
  Canvas canvas(60, 50);
  canvas.cells({10.0, 5.0, 40.0, 30.0}, nx, ny, colour);
  const Picture picture = decode(canvas.encode());
  EXPECT_EQ(picture.width, 60);
  EXPECT_EQ(picture.height, 50);
  // Every pixel of the box has its cell's colour, to the very edge, and none outside has.
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const bool inside = x >= 10 && x < 50 && y >= 5 && y < 35;
      const Colour expected = inside ? colour((x - 10) / 10, ny - 1 - (y - 5) / 10) : white;
      ASSERT_EQ(picture.at(x, y), rgb(expected)) << x << ", " << y;
    }
  }
}

TEST(Canvas, AveragesCellsSmallerThanAPixel) {
  Canvas canvas(40, 40);
  canvas.cells({0.0, 0.0, 40.0, 40.0}, 400, 400,
               [](int i, int j) { return (i + j) % 2 == 0 ? white : Colour{}; });
  const Picture picture = decode(canvas.encode());
  for (int y = 1; y < 39; ++y) {
    for (int x = 1; x < 39; ++x) {
      // Half white, half black; the filter's weights differ a little from pixel to pixel.
      ASSERT_NEAR(picture.at(x, y) & 0xFF, 128, 16) << x << ", " << y;
    }
  }
}

TEST(Canvas, ClipsWhileTheClipLives) {
  const std::array across{glm::dvec2(0.0, 10.0), glm::dvec2(40.0, 10.0)};
  Canvas canvas(40, 20);
  {
    const Canvas::Clip clip(canvas, {10.0, 0.0, 10.0, 20.0});
    canvas.line(across, {.colour = {}, .width_px = 4.0});
  }
  const Picture clipped = decode(canvas.encode());
  EXPECT_EQ(clipped.at(15, 10), 0u);
  EXPECT_EQ(clipped.at(5, 10), 0xFFFFFFu);
  EXPECT_EQ(clipped.at(25, 10), 0xFFFFFFu);
  canvas.line(across, {.colour = {}, .width_px = 4.0});
  EXPECT_EQ(decode(canvas.encode()).at(25, 10), 0u);
}

TEST(Canvas, ShortensTextToTheWidth) {
  Canvas canvas(10, 10);
  const Font font{20.0};
  const std::string text = "größte Fläche";
  const double whole = canvas.text_width(text, font);
  EXPECT_EQ(canvas.fit(text, whole, font), text);
  for (double width = whole; width > 30.0; width -= 3.0) {
    const std::string shown = canvas.fit(text, width, font);
    EXPECT_LE(canvas.text_width(shown, font), width);
    EXPECT_EQ(shown.find('?'), std::string::npos) << shown << ": a character was cut in half";
  }
  EXPECT_EQ(canvas.fit(text, 0.0, font), "…");
}

/// Relative luminance of an sRGB colour (IEC 61966-2-1).
double luminance(const Colour& c) {
  const auto linear = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.red) + 0.7152 * linear(c.green) + 0.0722 * linear(c.blue);
}

/// CIE 1976 lightness, 0 to 100.
double lightness(const Colour& c) { return 116.0 * std::cbrt(luminance(c)) - 16.0; }

TEST(Palette, DivergingIsWhiteInTheMiddleAndDarkensEvenlyToBlueBelowAndToRedAbove) {
  EXPECT_EQ(rgb(diverging(0.0)), 0xFFFFFFu);
  double before = lightness(diverging(0.0));
  for (int k = 1; k <= 50; ++k) {
    const Colour above = diverging(k / 50.0);
    const Colour below = diverging(-k / 50.0);
    EXPECT_LT(lightness(above), before) << k;
    // Two measures of lightness, Oklab's and CIE's, differ for saturated colours; 8 of 100 is a
    // difference that no one reads as a different strength.
    EXPECT_NEAR(lightness(above), lightness(below), 8.0) << k;
    EXPECT_GT(above.red, above.blue) << k;
    EXPECT_GT(below.blue, below.red) << k;
    before = lightness(above);
  }
  EXPECT_NE(rgb(diverging(-0.02)), 0xFFFFFFu);
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

}  // namespace palpate::canvas_test
