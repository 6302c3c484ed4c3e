#include "cli/array_picture.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <glm/common.hpp>

#include "model/element_spacing.hpp"

namespace palpate::cli {

ArrayPicture::ArrayPicture(const std::vector<glm::dvec2>& elements_mm) {
  if (elements_mm.empty()) {
    return;
  }
  lower_mm_ = upper_mm_ = elements_mm.front();
  for (const glm::dvec2& p : elements_mm) {
    lower_mm_ = glm::min(lower_mm_, p);
    upper_mm_ = glm::max(upper_mm_, p);
  }
  // Elements closer than 1e-9 of the largest coordinate coincide but for rounding, which is about
  // 1e-16 of a coordinate.
  const glm::dvec2 largest_mm = glm::max(glm::abs(lower_mm_), glm::abs(upper_mm_));
  const double tiny_mm = 1e-9 * std::max(largest_mm.x, largest_mm.y);
  const std::optional<ElementSpacing> spacing = spacing_of(elements_mm, tiny_mm);
  const bool apart = spacing && std::isfinite(spacing->nearest_mm.least);
  half_mm_ = apart ? 0.5 * spacing->nearest_mm.least : 1.0;
  lower_mm_ -= half_mm_;
  upper_mm_ += half_mm_;
  placed_.reserve(elements_mm.size());
  for (std::size_t i = 0; i < elements_mm.size(); ++i) {
    const glm::dvec2& p = elements_mm[i];
    placed_.push_back({.row = row_of(p.y), .column = column_of(p.x), .element = i, .centre_mm = p});
  }
  std::ranges::sort(placed_, {},
                    [](const Placed& p) { return std::tuple(p.row, p.column, p.element); });
  // Only the first of several elements at one position can be seen.
  const auto end =
      std::unique(placed_.begin(), placed_.end(),
                  [](const Placed& a, const Placed& b) { return a.centre_mm == b.centre_mm; });
  placed_.erase(end, placed_.end());
}

double ArrayPicture::row_of(double y_mm) const {
  return std::floor((y_mm - lower_mm_.y) / (2.0 * half_mm_));
}

double ArrayPicture::column_of(double x_mm) const {
  return std::floor((x_mm - lower_mm_.x) / (2.0 * half_mm_));
}

std::optional<std::size_t> ArrayPicture::element_at(const glm::dvec2& p_mm) const {
  std::optional<std::size_t> found;
  // An element that covers the point has its centre in the point's cell or in a neighbouring cell.
  // `beside` is an integer: where rows are large numbers, row + 1 may equal row.
  for (int beside = -1; beside <= 1; ++beside) {
    const double row = row_of(p_mm.y) + beside;
    const double column = column_of(p_mm.x);
    const auto in_row = [](const Placed& p, const std::pair<double, double>& cell) {
      return std::pair(p.row, p.column) < cell;
    };
    for (auto p =
             std::lower_bound(placed_.begin(), placed_.end(), std::pair(row, column - 1.0), in_row);
         p != placed_.end() && p->row == row && p->column <= column + 1.0; ++p) {
      if (std::abs(p_mm.x - p->centre_mm.x) <= half_mm_ &&
          std::abs(p_mm.y - p->centre_mm.y) <= half_mm_) {
        found = std::min(found.value_or(p->element), p->element);
      }
    }
  }
  return found;
}

}  // namespace palpate::cli
