#include "io/svg_drawing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <cairo.h>
#include <librsvg/rsvg.h>
#include <glm/vec2.hpp>

#include "io/input_file.hpp"

namespace palpate {

namespace {

struct Destroy {
  void operator()(RsvgHandle* handle) const { g_object_unref(handle); }
  void operator()(GError* error) const { g_error_free(error); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Handle = std::unique_ptr<RsvgHandle, Destroy>;

/// Throws Error with the library's words where it failed.
void require(bool done, GError* error, const std::filesystem::path& path) {
  const std::unique_ptr<GError, Destroy> kept(error);
  if (!done) {
    std::string words = error != nullptr ? error->message : "unknown error";
    std::ranges::replace(words, '\n', ' ');
    refuse(path, "is no SVG drawing ({}); save it again as plain SVG", words);
  }
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (file.bad()) {
    refuse(path, "cannot be read; copy it again");
  }
  // Compressed files and UTF-16 would hide references to other files.
  if (text.find("<svg") == std::string::npos && text.find(":svg") == std::string::npos) {
    refuse(path, "holds no <svg> element; save it as plain SVG in UTF-8");
  }
  return text;
}

constexpr std::string_view blanks = " \t\r\n";

/// What is looked at of a reference: a drawing of many long ones is read in linear time.
constexpr std::size_t most_of_reference = 4096;

/// The value that begins the text, after blanks and with or without quotes.
std::string_view value_from(std::string_view text) {
  text = text.substr(0, most_of_reference);
  const auto skip = [&](std::string_view characters) {
    text.remove_prefix(std::min(text.find_first_not_of(characters), text.size()));
  };
  skip(blanks);
  for (const std::string_view quote : {"\"", "'", "&quot;", "&apos;"}) {
    if (text.starts_with(quote)) {
      text.remove_prefix(quote.size());
      return text.substr(0, text.find(quote));
    }
  }
  return text.substr(0, text.find_first_of(") \t\r\n"));
}

/// Throws Error where the drawing refers to what is not in it. The library would draw it without:
/// it opens no file, as it is not told where the drawing lies.
void require_whole(const std::filesystem::path& path, std::string_view svg) {
  const auto refuse_reference = [&](std::string_view to) {
    refuse(path, "refers to '{:.60}', which is not in it; embed or remove it", to);
  };
  const auto require_inside = [&](std::string_view to) {
    to.remove_prefix(std::min(to.find_first_not_of(blanks), to.size()));
    if (to.starts_with("data:image")) {
      refuse(path, "holds a picture; trace it as outlines, or remove it");
    }
    if (!to.empty() && !to.starts_with('#') && !to.starts_with("data:")) {
      refuse_reference(to);
    }
  };
  for (const std::string_view mark : {"href", "url("}) {
    for (std::size_t at = svg.find(mark); at != std::string_view::npos;
         at = svg.find(mark, at + 1)) {
      std::string_view rest = svg.substr(at + mark.size());
      if (mark == "url(") {
        require_inside(value_from(rest));
        continue;
      }
      rest.remove_prefix(std::min(rest.find_first_not_of(blanks), rest.size()));
      if (rest.starts_with('=')) {
        require_inside(value_from(rest.substr(1)));
      }
    }
  }
  for (const std::string_view mark : {"@import", "<?xml-stylesheet"}) {
    if (svg.find(mark) != std::string_view::npos) {
      refuse_reference(mark);
    }
  }
  for (std::size_t at = svg.find("<!ENTITY"); at != std::string_view::npos;
       at = svg.find("<!ENTITY", at + 1)) {
    std::string_view entity = svg.substr(at, most_of_reference);
    entity = entity.substr(0, entity.find('>'));
    if (entity.find(" SYSTEM ") != std::string_view::npos ||
        entity.find(" PUBLIC ") != std::string_view::npos) {
      refuse_reference(entity);
    }
  }
}

/// Millimetres of a length's unit; none of a unit that is none of length.
std::optional<double> mm_of(RsvgUnit unit) {
  constexpr double inch = 25.4;
  switch (unit) {
    case RSVG_UNIT_MM:
      return 1.0;
    case RSVG_UNIT_CM:
      return 10.0;
    case RSVG_UNIT_IN:
      return inch;
    case RSVG_UNIT_PT:
      return inch / 72.0;
    case RSVG_UNIT_PC:
      return inch / 6.0;
    default:
      return {};
  }
}

/// The drawing's size in mm.
glm::dvec2 size_of(const std::filesystem::path& path, RsvgHandle* handle,
                   const std::optional<double>& mm_per_pixel) {
  gboolean has_width = FALSE;
  gboolean has_height = FALSE;
  gboolean has_box = FALSE;
  RsvgLength width{};
  RsvgLength height{};
  RsvgRectangle box{};
  rsvg_handle_get_intrinsic_dimensions(handle, &has_width, &width, &has_height, &height, &has_box,
                                       &box);
  std::optional<double> width_mm = mm_of(width.unit);
  std::optional<double> height_mm = mm_of(height.unit);
  if (has_box != FALSE && width_mm.has_value() != height_mm.has_value()) {
    // The other side follows from the shape of the box.
    const double box_mm =
        width_mm ? width.length * *width_mm / box.width : height.length * *height_mm / box.height;
    width = {box.width, RSVG_UNIT_MM};
    height = {box.height, RSVG_UNIT_MM};
    width_mm = height_mm = box_mm;
  }
  const bool physical = width_mm && height_mm;
  const bool in_pixels = width.unit == RSVG_UNIT_PX && height.unit == RSVG_UNIT_PX;
  if (!physical && !in_pixels && has_box == FALSE) {
    refuse(path, "has neither width and height in mm nor a viewBox; give it one of them");
  }
  if (physical && mm_per_pixel) {
    refuse(path, "is {:.6g} x {:.6g} mm large, as it says; leave `mm-per-pixel {}` out",
           width.length * *width_mm, height.length * *height_mm, *mm_per_pixel);
  }
  if (!physical && !mm_per_pixel) {
    refuse(path,
           "has no width and height in mm; save it with its size, or say how large its unit "
           "is with `mm-per-pixel`");
  }
  const glm::dvec2 units = physical || in_pixels ? glm::dvec2(width.length, height.length)
                                                 : glm::dvec2(box.width, box.height);
  const glm::dvec2 size_mm =
      units * (physical ? glm::dvec2(*width_mm, *height_mm) : glm::dvec2(*mm_per_pixel));
  if (!(size_mm.x > 0.0 && size_mm.y > 0.0)) {
    refuse(path, "is {:g} x {:g} mm large; give it a size above 0", size_mm.x, size_mm.y);
  }
  return size_mm;
}

}  // namespace

GreyPicture draw_svg(const std::filesystem::path& path, const DrawingOptions& options) {
  const std::string svg = content_of(path);
  require_whole(path, svg);
  GError* error = nullptr;
  const Handle handle(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error));
  require(handle != nullptr, error, path);
  const glm::dvec2 size_mm = size_of(path, handle.get(), options.mm_per_pixel);
  const glm::dvec2 size = size_mm / options.pixel_mm;
  constexpr const char* remedy = "use larger cells";
  require_few_pixels(path, std::ceil(size.x), std::ceil(size.y), remedy);
  constexpr double most_on_a_side = 32767.0;  // of Cairo's pictures
  if (std::max(size.x, size.y) > most_on_a_side) {
    refuse(path, "{:.6g} x {:.6g} pixels are more than {:g} along one side; {}", size.x, size.y,
           most_on_a_side, remedy);
  }
  const auto columns = static_cast<int>(std::ceil(size.x));
  const auto rows = static_cast<int>(std::ceil(size.y));
  const std::unique_ptr<cairo_surface_t, Destroy> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, columns, rows));
  const std::unique_ptr<cairo_t, Destroy> context(cairo_create(surface.get()));
  const double paper = options.light ? 0.0 : 1.0;
  cairo_set_source_rgb(context.get(), paper, paper, paper);
  cairo_paint(context.get());
  // The lower left corner of the drawing is that of the picture.
  const RsvgRectangle page{0.0, rows - size.y, size.x, size.y};
  GError* failure = nullptr;
  const bool drawn =
      rsvg_handle_render_document(handle.get(), context.get(), &page, &failure) != FALSE;
  require(drawn, failure, path);
  cairo_surface_flush(surface.get());
  if (const cairo_status_t status = cairo_status(context.get()); status != CAIRO_STATUS_SUCCESS) {
    throw Error(Fault::system, fmt::format("{}: a picture of {} x {} pixels: {}", path.string(),
                                           columns, rows, cairo_status_to_string(status)));
  }
  GreyPicture picture{.rows = static_cast<std::size_t>(rows),
                      .columns = static_cast<std::size_t>(columns),
                      .pixel_mm = options.pixel_mm};
  picture.grey.reserve(picture.rows * picture.columns);
  const unsigned char* pixels = cairo_image_surface_get_data(surface.get());
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface.get()));
  for (std::size_t row = 0; row < picture.rows; ++row) {
    const auto* line = reinterpret_cast<const std::uint32_t*>(pixels + row * stride);
    for (std::size_t column = 0; column < picture.columns; ++column) {
      const std::uint32_t rgb = line[column];
      picture.grey.push_back(luma(rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255));
    }
  }
  return picture;
}

}  // namespace palpate
