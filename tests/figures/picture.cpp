#include "picture.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <png.h>

namespace palpate {

Picture decode(const std::string& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, png.data(), png.size()) == 0) {
    ADD_FAILURE() << image.message;
    return {};
  }
  image.format = PNG_FORMAT_BGRA;  // words of 0xAARRGGBB
  Picture picture{.width = static_cast<int>(image.width),
                  .height = static_cast<int>(image.height),
                  .pixels = std::vector<std::uint32_t>(image.width * image.height)};
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr), 0)
      << image.message;
  std::ranges::for_each(picture.pixels, [](std::uint32_t& pixel) { pixel &= 0xFFFFFF; });
  return picture;
}

Difference difference(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  Difference d{.left = a.width, .top = a.height, .right = -1, .bottom = -1};
  for (int y = 0; y < std::min(a.height, b.height); ++y) {
    for (int x = 0; x < std::min(a.width, b.width); ++x) {
      if (a.at(x, y) != b.at(x, y)) {
        ++d.pixels;
        d.left = std::min(d.left, x);
        d.top = std::min(d.top, y);
        d.right = std::max(d.right, x);
        d.bottom = std::max(d.bottom, y);
      }
    }
  }
  return d;
}

std::uint32_t rgb(const Colour& colour) {
  const auto byte = [](double v) { return static_cast<std::uint32_t>(std::lround(255.0 * v)); };
  return byte(colour.red) << 16 | byte(colour.green) << 8 | byte(colour.blue);
}

double area(const std::vector<glm::dvec2>& polygon) {
  double twice = 0.0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const glm::dvec2 a = polygon[k];
    const glm::dvec2 b = polygon[(k + 1) % polygon.size()];
    twice += a.x * b.y - a.y * b.x;
  }
  return twice / 2.0;
}

}  // namespace palpate
