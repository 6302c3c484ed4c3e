#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "palpate/drawn_map.hpp"
#include "palpate/error.hpp"
#include "simulation/spans.hpp"

namespace palpate {

Mask mask_of(const Shape& shape, double pixel_mm) {
  const BoundingBox box = bounds_of(shape);
  const glm::dvec2 pixels = glm::ceil(box.extent() / pixel_mm);
  if (!(pixels.x * pixels.y <= most_pixels)) {
    throw Error(Fault::input, fmt::format("shape '{}': {:.3g} x {:.3g} pixels of {} mm are more "
                                          "than {:g}; use larger cells",
                                          shape.label, pixels.x, pixels.y, pixel_mm, most_pixels));
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
