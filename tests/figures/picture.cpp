#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>

#include <cairo.h>
#include <gtest/gtest.h>

namespace palpate {

Picture decode(const std::string& png) {
  std::string_view left = png;
  const auto take = [](void* rest, unsigned char* data, unsigned int size) {
    auto& bytes = *static_cast<std::string_view*>(rest);
    if (bytes.size() < size) {
      return CAIRO_STATUS_READ_ERROR;
    }
    std::memcpy(data, bytes.data(), size);
    bytes.remove_prefix(size);
    return CAIRO_STATUS_SUCCESS;
  };
  const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface(
      cairo_image_surface_create_from_png_stream(take, &left), cairo_surface_destroy);
  EXPECT_EQ(cairo_surface_status(surface.get()), CAIRO_STATUS_SUCCESS);
  EXPECT_TRUE(left.empty()) << left.size() << " bytes after the picture";
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) {
    return {};
  }

  Picture picture{.width = cairo_image_surface_get_width(surface.get()),
                  .height = cairo_image_surface_get_height(surface.get()),
                  .pixels = {}};
  const unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      std::uint32_t pixel = 0;
      std::memcpy(&pixel, data + static_cast<std::ptrdiff_t>(y) * stride + 4 * x, sizeof pixel);
      picture.pixels.push_back(pixel & 0xFFFFFF);
    }
  }
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
