#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "palpate/drawn_map.hpp"

namespace palpate {

/// How a drawing is read.
struct DrawingOptions {
  std::optional<double> mm_per_pixel = {};  ///< edge of a pixel; needed
  bool light = false;                       ///< light places are occupied, not dark ones
};

/// Whether the file's name ends as that of a drawing: .png, or .svg, which read_drawing() refuses
/// with the command that makes a PNG of it.
bool is_drawing(const std::filesystem::path& path);

/// Reads which places of a PNG picture are occupied: those darker than middle grey, or those
/// lighter. What is transparent is not occupied. The origin is the lower left corner of the
/// picture, x is to the right and y up.
/// @throws Error naming the file or the option and the remedy: of a file that is no PNG picture,
/// `mm-per-pixel` missing, more than `most_pixels`, and nothing occupied
Mask read_drawing(const std::filesystem::path& path, const DrawingOptions& options);

/// Which edges of the picture have occupied pixels, as "left, upper"; "" where none has. An object
/// that reaches one may go on beyond it.
std::string reached_edges(const Mask& mask);

}  // namespace palpate
