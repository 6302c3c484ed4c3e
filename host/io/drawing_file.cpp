#include "io/drawing_file.hpp"

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <utility>

#include <png.h>

#include "io/input_file.hpp"

namespace palpate {

namespace {

/// Grey of a colour, by Rec. 709.
std::uint8_t luma(std::uint32_t red, std::uint32_t green, std::uint32_t blue) {
  return static_cast<std::uint8_t>((54 * red + 183 * green + 19 * blue) / 256);
}

bool ends_in(const std::filesystem::path& path, const char* ending) {
  const auto lower = [](unsigned char c) { return std::tolower(c); };
  return std::ranges::equal(path.extension().string(), std::string_view(ending), {}, lower);
}

/// Reads which places of a PNG picture on white paper, or black where light is occupied, are
/// occupied.
Mask read_png(const std::filesystem::path& path, const DrawingOptions& options) {
  struct Image : png_image {
    Image() : png_image{} { version = PNG_IMAGE_VERSION; }
    ~Image() { png_image_free(this); }
    Image(const Image&) = delete;
    Image& operator=(const Image&) = delete;
  } image;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) {
    refuse(path, "is no PNG picture ({}); save it again as PNG", image.message);
  }
  if (static_cast<double>(image.width) * image.height > most_pixels) {
    refuse(path, "{} x {} pixels are more than {:g}; save it with fewer", image.width, image.height,
           most_pixels);
  }
  if (!options.mm_per_pixel) {
    refuse(path,
           "a picture of {} x {} pixels has no physical size; say how large a pixel is with "
           "`mm-per-pixel`",
           image.width, image.height);
  }
  image.format = PNG_FORMAT_RGBA;
  std::vector<png_byte> colours(PNG_IMAGE_SIZE(image));
  const int upwards = -static_cast<int>(PNG_IMAGE_ROW_STRIDE(image));
  if (png_image_finish_read(&image, nullptr, colours.data(), upwards, nullptr) == 0) {
    refuse(path, "is damaged ({}); save it again as PNG", image.message);
  }
  Mask mask{.pixel_mm = *options.mm_per_pixel,
            .origin_mm = glm::dvec2(*options.mm_per_pixel / 2.0),
            .rows = image.height,
            .columns = image.width};
  mask.occupied.reserve(colours.size() / 4);
  // Transparent edges are mixed with the paper as viewers do: without gamma.
  const std::uint32_t paper = options.light ? 0 : 255;
  constexpr std::uint8_t middle_grey = 128;
  for (std::size_t i = 0; i < colours.size(); i += 4) {
    const std::uint32_t alpha = colours[i + 3];
    const auto over = [&](std::uint32_t c) { return (c * alpha + paper * (255 - alpha)) / 255; };
    const bool is_light =
        luma(over(colours[i]), over(colours[i + 1]), over(colours[i + 2])) >= middle_grey;
    mask.occupied.push_back(is_light == options.light ? 1 : 0);
  }
  return mask;
}

}  // namespace

bool is_drawing(const std::filesystem::path& path) {
  return ends_in(path, ".png") || ends_in(path, ".svg");
}

Mask read_drawing(const std::filesystem::path& path, const DrawingOptions& options) {
  require_readable(path);
  if (ends_in(path, ".svg")) {
    refuse(path,
           "drawings are read as PNG; make one of 0.1 mm per pixel by rsvg-convert -d 254 -p "
           "254 -o PART.png PART.svg, and give `mm-per-pixel 0.1`");
  }
  if (options.mm_per_pixel &&
      !(*options.mm_per_pixel >= least_length_mm && *options.mm_per_pixel <= most_length_mm)) {
    refuse(fmt::format("`mm-per-pixel {}`", *options.mm_per_pixel), "give {:g} to {:g} mm",
           least_length_mm, most_length_mm);
  }
  Mask mask = read_png(path, options);
  if (std::ranges::count(mask.occupied, 1) == 0) {
    refuse(path, "nothing in it is {}; fill the object's area {}, or give `occupied {}`",
           options.light ? "light" : "dark", options.light ? "white" : "black",
           options.light ? "dark" : "light");
  }
  return mask;
}

std::string reached_edges(const Mask& mask) {
  const auto reaches = [&](std::size_t first, std::size_t count, std::size_t step) {
    for (std::size_t i = 0; i < count; ++i) {
      if (mask.occupied[first + i * step] != 0) {
        return true;
      }
    }
    return false;
  };
  const std::size_t columns = mask.columns;
  std::string edges;
  for (const auto& [reached, name] :
       {std::pair(reaches(0, mask.rows, columns), "left"),
        std::pair(reaches(columns - 1, mask.rows, columns), "right"),
        std::pair(reaches(0, columns, 1), "lower"),
        std::pair(reaches((mask.rows - 1) * columns, columns, 1), "upper")}) {
    if (reached) {
      edges += (edges.empty() ? "" : ", ") + std::string(name);
    }
  }
  return edges;
}

}  // namespace palpate
