#include "simulation/spans.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "model/refuse.hpp"
#include "palpate/drawn_map.hpp"

namespace palpate {

namespace {

/// Adds the part of the line at `y` within `radius` of the segment ab. It is one interval, since
/// the capsule is convex; its ends are the outermost crossings with the two discs and the two
/// sides.
void add_capsule(const glm::dvec2& a, const glm::dvec2& b, double radius, double y,
                 std::vector<Span>& spans) {
  if (y < std::min(a.y, b.y) - radius || y > std::max(a.y, b.y) + radius) {
    return;
  }
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Span span{infinity, -infinity};
  const auto include = [&span](double x) {
    span.begin = std::min(span.begin, x);
    span.end = std::max(span.end, x);
  };
  for (const glm::dvec2& p : {a, b}) {
    const double rest = radius * radius - (y - p.y) * (y - p.y);
    if (rest >= 0.0) {
      include(p.x - std::sqrt(rest));
      include(p.x + std::sqrt(rest));
    }
  }
  // Sides parallel to the line add nothing: the interval then ends on the discs.
  const glm::dvec2 along = b - a;
  if (along.y != 0.0) {
    const glm::dvec2 across = glm::dvec2(-along.y, along.x) * (radius / glm::length(along));
    for (const glm::dvec2& start : {a + across, a - across}) {
      const double t = (y - start.y) / along.y;
      if (t >= 0.0 && t <= 1.0) {
        include(start.x + t * along.x);
      }
    }
  }
  if (span.begin <= span.end) {
    spans.push_back(span);
  }
}

/// Adds the part of the line at `y` inside the polygons, by the even-odd rule.
void add_polygons(const std::vector<std::vector<glm::dvec2>>& polygons, double y,
                  std::vector<Span>& spans) {
  std::vector<double> crossings;
  for (const std::vector<glm::dvec2>& polygon : polygons) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const glm::dvec2& a = polygon[i];
      const glm::dvec2& b = polygon[(i + 1) % polygon.size()];
      // Edges are half open, so that a line through a vertex counts it once.
      if ((a.y <= y) != (b.y <= y)) {
        crossings.push_back(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
      }
    }
  }
  std::sort(crossings.begin(), crossings.end());
  for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
    spans.push_back({crossings[i], crossings[i + 1]});
  }
}

}  // namespace

bool encloses_area(const std::vector<glm::dvec2>& polygon) {
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const glm::dvec2 a = polygon[i - 1] - polygon[0];
    const glm::dvec2 b = polygon[i] - polygon[0];
    if (a.x * b.y != a.y * b.x) {
      return true;
    }
  }
  return false;
}

BoundingBox bounds_of(const Shape& shape) {
  BoundingBox box;
  const auto include = [&](const glm::dvec2& p, double width_mm) {
    // Written so that NaN is refused. 1 km is far beyond any object, yet rounding does not swallow
    // a cell there.
    if (!(std::abs(p.x) <= most_length_mm && std::abs(p.y) <= most_length_mm && width_mm >= 0.0 &&
          width_mm <= most_length_mm)) {
      refuse(fmt::format("shape '{}'", shape.label),
             "point {},{} of a line {} mm wide: give coordinates within {} mm of 0 and a width "
             "that is not negative",
             p.x, p.y, width_mm, most_length_mm);
    }
    box.take_in(p - width_mm / 2.0);
    box.take_in(p + width_mm / 2.0);
  };
  for (const Shape::Stroke& stroke : shape.strokes) {
    for (const glm::dvec2& p : stroke.points_mm) {
      include(p, stroke.width_mm);
    }
  }
  for (const std::vector<glm::dvec2>& polygon : shape.polygons) {
    for (const glm::dvec2& p : polygon) {
      include(p, 0.0);
    }
  }
  if (!(box.lower.x < box.upper.x && box.lower.y < box.upper.y) ||
      (shape.strokes.empty() && std::ranges::none_of(shape.polygons, encloses_area))) {
    refuse(fmt::format("shape '{}'", shape.label), "covers no area, so it cannot be touched");
  }
  return box;
}

std::vector<Span> spans(const Shape& shape, double y_mm) {
  std::vector<Span> found;
  for (const Shape::Stroke& stroke : shape.strokes) {
    const std::vector<glm::dvec2>& points = stroke.points_mm;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // The first point is also a capsule of its own: a stroke of one point is a disc.
      add_capsule(points[i == 0 ? 0 : i - 1], points[i], stroke.width_mm / 2.0, y_mm, found);
    }
  }
  add_polygons(shape.polygons, y_mm, found);

  std::sort(found.begin(), found.end(),
            [](const Span& a, const Span& b) { return a.begin < b.begin; });
  std::vector<Span> disjoint;
  for (const Span& span : found) {
    if (disjoint.empty() || span.begin > disjoint.back().end) {
      disjoint.push_back(span);
    } else {
      disjoint.back().end = std::max(disjoint.back().end, span.end);
    }
  }
  return disjoint;
}

Mask mask_of(const Shape& shape, double pixel_mm) {
  const BoundingBox box = bounds_of(shape);
  const glm::dvec2 pixels = glm::ceil(box.extent() / pixel_mm);
  if (!(pixels.x * pixels.y <= most_pixels)) {
    refuse(fmt::format("shape '{}'", shape.label),
           "{:.3g} x {:.3g} pixels of {} mm are more than {:g}; use larger cells", pixels.x,
           pixels.y, pixel_mm, most_pixels);
  }
  Mask mask{.pixel_mm = pixel_mm,
            .origin_mm = box.lower + pixel_mm / 2.0,
            .rows = static_cast<std::size_t>(pixels.y),
            .columns = static_cast<std::size_t>(pixels.x)};
  mask.occupied.assign(mask.rows * mask.columns, 0);
  for (std::size_t row = 0; row < mask.rows; ++row) {
    const double y_mm = mask.origin_mm.y + pixel_mm * static_cast<double>(row);
    for (const Span& span : spans(shape, y_mm)) {
      // The pixels whose centres lie in the span.
      const auto first = [&](double x_mm) {
        const double index = std::ceil((x_mm - mask.origin_mm.x) / pixel_mm);
        return static_cast<std::ptrdiff_t>(std::clamp(index, 0.0, pixels.x));
      };
      const auto pixels_of_row =
          mask.occupied.begin() + static_cast<std::ptrdiff_t>(row * mask.columns);
      std::fill(pixels_of_row + first(span.begin), pixels_of_row + first(span.end), 1);
    }
  }
  return mask;
}

}  // namespace palpate
