#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "palpate/drawn_map.hpp"

namespace palpate {

/// How a drawing is read.
struct DrawingOptions {
  /// Edge of a pixel of a PNG picture, or of the unit of an SVG drawing that names no physical
  /// size.
  std::optional<double> mm_per_pixel = {};
  bool light = false;     ///< light places are occupied, not dark ones
  double pixel_mm = 0.1;  ///< of the mask of an SVG drawing, at most
};

/// Whether the file's name ends as that of a drawing, .svg or .png.
bool is_drawing(const std::filesystem::path& path);

/// Reads which places of a drawing are occupied: those darker than middle grey, or those lighter.
/// What is transparent is not occupied. The origin is the lower left corner of the picture, x is to
/// the right and y up.
/// @throws Error naming the file or the option and the remedy: of a file that is no drawing, an SVG
/// drawing that refers to other files, whatever it draws, one without a size, `mm-per-pixel`
/// missing, or given beside a physical size, more than `most_pixels`, and nothing occupied
Mask read_drawing(const std::filesystem::path& path, const DrawingOptions& options);

/// Which edges of the picture have occupied pixels, as "left, upper"; "" where none has. An object
/// that reaches one may go on beyond it.
std::string reached_edges(const Mask& mask);

}  // namespace palpate
