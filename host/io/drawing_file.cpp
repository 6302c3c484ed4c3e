#include "io/drawing_file.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <png.h>

#include "io/input_file.hpp"
#include "io/svg_drawing.hpp"

namespace palpate {

namespace {

/// The ending of the file's name in small letters.
std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return ending;
}

/// Reads a PNG picture on white paper, or black where light is occupied.
GreyPicture read_png(const std::filesystem::path& path, const DrawingOptions& options) {
  struct Image : png_image {
    Image() : png_image{} { version = PNG_IMAGE_VERSION; }
    ~Image() { png_image_free(this); }
    Image(const Image&) = delete;
    Image& operator=(const Image&) = delete;
  } image;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) {
    refuse(path, "is no PNG picture ({}); save it again as PNG", image.message);
  }
  require_few_pixels(path, image.width, image.height, "save it with fewer");
  if (!options.mm_per_pixel) {
    refuse(path,
           "a picture of {} x {} pixels has no physical size; say how large a pixel is with "
           "`mm-per-pixel`",
           image.width, image.height);
  }
  GreyPicture picture{
      .rows = image.height, .columns = image.width, .pixel_mm = *options.mm_per_pixel};
  image.format = PNG_FORMAT_RGBA;
  std::vector<png_byte> colours(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, colours.data(), 0, nullptr) == 0) {
    refuse(path, "is damaged ({}); save it again as PNG", image.message);
  }
  // Transparent edges are as dark as an SVG's, which cairo draws: without gamma.
  const std::uint32_t paper = options.light ? 0 : 255;
  picture.grey.reserve(colours.size() / 4);
  for (std::size_t i = 0; i < colours.size(); i += 4) {
    const std::uint32_t alpha = colours[i + 3];
    const auto over = [&](std::uint32_t c) { return (c * alpha + paper * (255 - alpha)) / 255; };
    picture.grey.push_back(luma(over(colours[i]), over(colours[i + 1]), over(colours[i + 2])));
  }
  return picture;
}

}  // namespace

void require_few_pixels(const std::filesystem::path& path, double columns, double rows,
                        const char* remedy) {
  if (!(columns * rows <= most_pixels)) {
    refuse(path, "{:.6g} x {:.6g} pixels are more than {:g}; {}", columns, rows, most_pixels,
           remedy);
  }
}

bool is_drawing(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  return ending == ".svg" || ending == ".png";
}

Mask read_drawing(const std::filesystem::path& path, const DrawingOptions& options) {
  require_readable(path);
  if (options.mm_per_pixel &&
      !(*options.mm_per_pixel >= least_length_mm && *options.mm_per_pixel <= most_length_mm)) {
    refuse(fmt::format("`mm-per-pixel {}`", *options.mm_per_pixel), "give {:g} to {:g} mm",
           least_length_mm, most_length_mm);
  }
  const GreyPicture picture =
      ending_of(path) == ".svg" ? draw_svg(path, options) : read_png(path, options);
  Mask mask{.pixel_mm = picture.pixel_mm,
            .origin_mm = glm::dvec2(picture.pixel_mm / 2.0),
            .rows = picture.rows,
            .columns = picture.columns};
  mask.occupied.reserve(picture.grey.size());
  constexpr std::uint8_t middle_grey = 128;
  for (std::size_t row = picture.rows; row-- > 0;) {
    for (std::size_t column = 0; column < picture.columns; ++column) {
      const bool is_light = picture.grey[row * picture.columns + column] >= middle_grey;
      mask.occupied.push_back(is_light == options.light ? 1 : 0);
    }
  }
  if (std::ranges::count(mask.occupied, 1) == 0) {
    refuse(path, "nothing in it is {}; fill the object's area {}, or give `occupied {}`",
           options.light ? "light" : "dark", options.light ? "white" : "black",
           options.light ? "dark" : "light");
  }
  return mask;
}

std::string reached_edges(const Mask& mask) {
  bool left = false, right = false, lower = false, upper = false;
  for (std::size_t i = 0; i < mask.occupied.size(); ++i) {
    const std::size_t row = i / mask.columns;
    const std::size_t column = i % mask.columns;
    const bool occupied = mask.occupied[i] != 0;
    left |= occupied && column == 0;
    right |= occupied && column + 1 == mask.columns;
    lower |= occupied && row == 0;
    upper |= occupied && row + 1 == mask.rows;
  }
  std::string edges;
  for (const auto& [reached, name] : {std::pair(left, "left"), std::pair(right, "right"),
                                      std::pair(lower, "lower"), std::pair(upper, "upper")}) {
    if (reached) {
      edges += (edges.empty() ? "" : ", ") + std::string(name);
    }
  }
  return edges;
}

#ifndef PALPATE_SVG

GreyPicture draw_svg(const std::filesystem::path& path, const DrawingOptions& /*options*/) {
  refuse(path, "this build reads no SVG; save the drawing as PNG, and give `mm-per-pixel`");
}

#endif

}  // namespace palpate
