#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/palette.hpp"

namespace palpate {

/// A decoded PNG file; pixels are 0xRRGGBB.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> pixels;  ///< [height, width]

  std::uint32_t at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
  }
};

/// Fails the test and returns an empty picture where the bytes are not a whole PNG file.
Picture decode(const std::string& png);

/// The pixels in which two pictures of one size differ: how many, and the rectangle around them.
struct Difference {
  int pixels = 0;
  int left = 0, top = 0, right = 0, bottom = 0;  ///< the last column and row belong to it
};
Difference difference(const Picture& a, const Picture& b);

/// 0xRRGGBB.
std::uint32_t rgb(const Colour& colour);

/// Of a polygon, above 0 where it is counter-clockwise.
double area(const std::vector<glm::dvec2>& polygon);

}  // namespace palpate
