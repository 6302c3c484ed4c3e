#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "io/drawing_file.hpp"

namespace palpate {

/// A picture of grey values, row 0 at the top.
struct GreyPicture {
  std::size_t rows = 0;
  std::size_t columns = 0;
  double pixel_mm = 0.0;
  std::vector<std::uint8_t> grey = {};  ///< [rows, columns], 0 is black
};

/// Grey of a colour, by Rec. 709.
inline std::uint8_t luma(std::uint32_t red, std::uint32_t green, std::uint32_t blue) {
  return static_cast<std::uint8_t>((54 * red + 183 * green + 19 * blue) / 256);
}

/// Throws Error where so many pixels are too many.
/// @param remedy what to do about it
void require_few_pixels(const std::filesystem::path& path, double columns, double rows,
                        const char* remedy);

/// Draws an SVG drawing on white paper, or black where light is occupied.
/// @throws Error as read_drawing()
GreyPicture draw_svg(const std::filesystem::path& path, const DrawingOptions& options);

}  // namespace palpate
