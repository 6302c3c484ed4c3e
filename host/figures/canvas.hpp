#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include <cairo.h>
#include <glm/vec2.hpp>

#include "figures/palette.hpp"

namespace palpate {

/// A rectangle in pixels, y down.
struct Box {
  double left = 0.0;
  double top = 0.0;
  double width = 0.0;
  double height = 0.0;

  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

struct Font {
  double size_px = 20.0;
  bool bold = false;

  /// Distance from the middle of a line of text down to its baseline.
  double half_height_px() const { return 0.36 * size_px; }
};

enum class Align { left, centre, right };

/// Style of a line; a white halo keeps it apart from any background.
struct Pen {
  Colour colour = ink;
  double width_px = 2.0;
  bool dashed = false;
  double halo_px = 0.0;  ///< on each side
};

/// A white sheet in memory to draw on; coordinates in pixels, y down.
class Canvas {
 public:
  /// @throws Error (Fault::system) if there is no memory for that many pixels.
  Canvas(int width_px, int height_px);

  /// Writes text whose baseline has its left end, centre or right end at `at`. Bytes that are not
  /// UTF-8 and control characters show as '?'.
  void text(std::string_view text, glm::dvec2 at, const Font& font, Align align = Align::left,
            const Colour& colour = ink);
  /// Writes text that reads from bottom to top.
  void text_upwards(std::string_view text, glm::dvec2 at, const Font& font, Align align);
  double text_width(std::string_view text, const Font& font);
  /// Returns the text, or as much of its beginning as fits into this width with an ellipsis.
  std::string fit(std::string_view text, double width_px, const Font& font);

  void line(std::span<const glm::dvec2> points, const Pen& pen);
  void segment(glm::dvec2 from, glm::dvec2 to, const Pen& pen);
  void polygon(std::span<const glm::dvec2> corners, const Pen& pen);
  void fill(std::span<const glm::dvec2> corners, const Colour& colour);
  void circle(glm::dvec2 centre, double radius_px, const Pen& pen);
  void disc(glm::dvec2 centre, double radius_px, const Colour& colour);
  void frame(const Box& box, const Pen& pen);
  /// Fills the box with nx * ny cells of these colours; row j = 0 is the lowest.
  void cells(const Box& box, int nx, int ny, const std::function<Colour(int i, int j)>& colour);

  /// Keeps drawing inside the box while it lives.
  class Clip {
   public:
    Clip(Canvas& canvas, const Box& box);
    ~Clip();
    Clip(const Clip&) = delete;
    Clip& operator=(const Clip&) = delete;

   private:
    cairo_t* context_;
  };

  /// Returns the canvas as the bytes of a PNG file.
  /// @throws Error (Fault::system) if anything drawn so far failed.
  std::string encode();

 private:
  struct Destroy {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* context) const { cairo_destroy(context); }
  };

  void select(const Font& font);
  void show(const std::string& text, Align align, const Colour& colour);
  void stroke(const Pen& pen);

  std::unique_ptr<cairo_surface_t, Destroy> surface_;
  std::unique_ptr<cairo_t, Destroy> context_;
};

}  // namespace palpate
