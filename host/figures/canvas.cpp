#include "figures/canvas.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <png.h>

#include "model/printable.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

void require(cairo_status_t status, const std::string& what) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw Error(Fault::system, fmt::format("{}: {}", what, cairo_status_to_string(status)));
  }
}

void set_source(cairo_t* context, const Colour& c) {
  cairo_set_source_rgba(context, c.red, c.green, c.blue, c.alpha);
}

std::uint32_t rgb24(const Colour& c) {
  const auto byte = [](double v) { return static_cast<std::uint32_t>(std::lround(255.0 * v)); };
  return byte(c.red) << 16 | byte(c.green) << 8 | byte(c.blue);
}

void trace(cairo_t* context, std::span<const glm::dvec2> points) {
  cairo_new_path(context);
  for (const glm::dvec2& p : points) {
    cairo_line_to(context, p.x, p.y);
  }
}

}  // namespace

Canvas::Canvas(int width_px, int height_px)
    : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px)),
      context_(cairo_create(surface_.get())) {
  cairo_t* context = context_.get();
  const std::string what = fmt::format("picture of {} x {} pixels", width_px, height_px);
  require(cairo_surface_status(surface_.get()), what);
  require(cairo_status(context), what);
  set_source(context, white);
  cairo_paint(context);
  cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);

  // Fixed font options, so that the desktop's settings do not change the picture.
  const std::unique_ptr<cairo_font_options_t, void (*)(cairo_font_options_t*)> options(
      cairo_font_options_create(), cairo_font_options_destroy);
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context, options.get());
}

void Canvas::select(const Font& font) {
  cairo_select_font_face(context_.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         font.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context_.get(), font.size_px);
}

void Canvas::show(const std::string& text, Align align, const Colour& colour) {
  cairo_text_extents_t extents;
  cairo_text_extents(context_.get(), text.c_str(), &extents);
  const double share = align == Align::left ? 0.0 : align == Align::centre ? 0.5 : 1.0;
  cairo_rel_move_to(context_.get(), -share * extents.x_advance, 0.0);
  set_source(context_.get(), colour);
  cairo_show_text(context_.get(), text.c_str());
}

void Canvas::text(std::string_view text, glm::dvec2 at, const Font& font, Align align,
                  const Colour& colour) {
  select(font);
  cairo_move_to(context_.get(), at.x, at.y);
  show(printable(text), align, colour);
}

void Canvas::text_upwards(std::string_view text, glm::dvec2 at, const Font& font, Align align) {
  cairo_save(context_.get());
  cairo_translate(context_.get(), at.x, at.y);
  cairo_rotate(context_.get(), -std::numbers::pi / 2);
  this->text(text, {0.0, 0.0}, font, align);
  cairo_restore(context_.get());
}

double Canvas::text_width(std::string_view text, const Font& font) {
  select(font);
  cairo_text_extents_t extents;
  cairo_text_extents(context_.get(), printable(text).c_str(), &extents);
  return extents.x_advance;
}

std::string Canvas::fit(std::string_view text, double width_px, const Font& font) {
  std::string kept = printable(text);
  if (text_width(kept, font) <= width_px) {
    return kept;
  }
  while (!kept.empty() && text_width(kept + "…", font) > width_px) {
    // A character ends where the next byte is not a continuation byte.
    while ((static_cast<unsigned char>(kept.back()) & 0xC0) == 0x80) {
      kept.pop_back();
    }
    kept.pop_back();
  }
  return kept + "…";
}

void Canvas::stroke(const Pen& pen) {
  cairo_t* context = context_.get();
  const double dash[] = {4.0 * pen.width_px, 3.0 * pen.width_px};
  cairo_set_dash(context, dash, pen.dashed ? 2 : 0, 0.0);
  if (pen.halo_px > 0.0) {
    set_source(context, {1.0, 1.0, 1.0, pen.colour.alpha});
    cairo_set_line_width(context, pen.width_px + 2.0 * pen.halo_px);
    cairo_stroke_preserve(context);
  }
  set_source(context, pen.colour);
  cairo_set_line_width(context, pen.width_px);
  cairo_stroke(context);
}

void Canvas::line(std::span<const glm::dvec2> points, const Pen& pen) {
  trace(context_.get(), points);
  stroke(pen);
}

void Canvas::segment(glm::dvec2 from, glm::dvec2 to, const Pen& pen) {
  const glm::dvec2 ends[] = {from, to};
  line(ends, pen);
}

void Canvas::polygon(std::span<const glm::dvec2> corners, const Pen& pen) {
  trace(context_.get(), corners);
  cairo_close_path(context_.get());
  stroke(pen);
}

void Canvas::fill(std::span<const glm::dvec2> corners, const Colour& colour) {
  trace(context_.get(), corners);
  set_source(context_.get(), colour);
  cairo_fill(context_.get());
}

void Canvas::circle(glm::dvec2 centre, double radius_px, const Pen& pen) {
  cairo_new_path(context_.get());
  cairo_arc(context_.get(), centre.x, centre.y, radius_px, 0.0, 2.0 * std::numbers::pi);
  stroke(pen);
}

void Canvas::disc(glm::dvec2 centre, double radius_px, const Colour& colour) {
  cairo_new_path(context_.get());
  cairo_arc(context_.get(), centre.x, centre.y, radius_px, 0.0, 2.0 * std::numbers::pi);
  set_source(context_.get(), colour);
  cairo_fill(context_.get());
}

void Canvas::frame(const Box& box, const Pen& pen) {
  cairo_new_path(context_.get());
  cairo_rectangle(context_.get(), box.left, box.top, box.width, box.height);
  stroke(pen);
}

void Canvas::cells(const Box& box, int nx, int ny,
                   const std::function<Colour(int i, int j)>& colour) {
  const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_RGB24, nx);
  const int row = stride / static_cast<int>(sizeof(std::uint32_t));
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(row) * ny);
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      pixels[static_cast<std::size_t>(ny - 1 - j) * row + i] = rgb24(colour(i, j));
    }
  }
  const std::unique_ptr<cairo_surface_t, Destroy> image(cairo_image_surface_create_for_data(
      reinterpret_cast<unsigned char*>(pixels.data()), CAIRO_FORMAT_RGB24, nx, ny, stride));
  require(cairo_surface_status(image.get()), fmt::format("picture of {} x {} cells", nx, ny));

  cairo_t* context = context_.get();
  cairo_save(context);
  cairo_new_path(context);
  cairo_rectangle(context, box.left, box.top, box.width, box.height);
  cairo_set_antialias(context, CAIRO_ANTIALIAS_NONE);
  cairo_translate(context, box.left, box.top);
  cairo_scale(context, box.width / nx, box.height / ny);
  cairo_set_source_surface(context, image.get(), 0.0, 0.0);
  cairo_pattern_t* pattern = cairo_get_source(context);
  cairo_pattern_set_extend(pattern, CAIRO_EXTEND_PAD);
  // Cells larger than a pixel keep sharp edges; smaller ones are averaged.
  const bool enlarged = box.width >= nx && box.height >= ny;
  cairo_pattern_set_filter(pattern, enlarged ? CAIRO_FILTER_NEAREST : CAIRO_FILTER_GOOD);
  cairo_fill(context);
  cairo_restore(context);
}

Canvas::Clip::Clip(Canvas& canvas, const Box& box) : context_(canvas.context_.get()) {
  cairo_save(context_);
  cairo_new_path(context_);
  cairo_rectangle(context_, box.left, box.top, box.width, box.height);
  cairo_clip(context_);
}

Canvas::Clip::~Clip() { cairo_restore(context_); }

std::string Canvas::encode() {
  require(cairo_status(context_.get()), "picture");
  cairo_surface_flush(surface_.get());
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(cairo_image_surface_get_width(surface_.get()));
  image.height = static_cast<png_uint_32>(cairo_image_surface_get_height(surface_.get()));
  image.format = PNG_FORMAT_RGB;
  // Without the search for row filters, which Cairo's own writer makes: most of a sheet is plain,
  // and hardly smaller for what takes four times as long.
  image.flags = PNG_IMAGE_FLAG_FAST;
  std::vector<png_byte> colours(PNG_IMAGE_SIZE(image));
  png_byte* to = colours.data();
  const unsigned char* row = cairo_image_surface_get_data(surface_.get());
  for (png_uint_32 y = 0; y < image.height; ++y) {
    for (png_uint_32 x = 0; x < image.width; ++x) {
      std::uint32_t pixel = 0;
      std::memcpy(&pixel, row + x * sizeof(pixel), sizeof(pixel));
      for (const int shift : {16, 8, 0}) {
        *to++ = static_cast<png_byte>(pixel >> shift);
      }
    }
    row += cairo_image_surface_get_stride(surface_.get());
  }
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, colours.data(), 0, nullptr) == 0) {
    throw Error(Fault::system, fmt::format("picture: {}", image.message));
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace palpate
