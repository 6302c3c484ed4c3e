#include "figures/label_places.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

namespace {

bool overlap(const Box& a, const Box& b) {
  return a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom();
}

bool holds(const Box& room, const Box& box) {
  return box.left >= room.left && box.right() <= room.right() && box.top >= room.top &&
         box.bottom() <= room.bottom();
}

/// The label's box beside its mark, off by some pixels in a direction; up is -pi/2.
Box beside(const PlacedLabel& label, double off_px, double angle) {
  const glm::dvec2 to{std::cos(angle), std::sin(angle)};
  const Box& mark = label.mark;
  const glm::dvec2 reach{(mark.width + label.size_px.x) / 2.0 + off_px,
                         (mark.height + label.size_px.y) / 2.0 + off_px};
  // As far as the boxes of mark and label, widened by off_px, touch.
  const double far = 1.0 / std::max(std::abs(to.x) / reach.x, std::abs(to.y) / reach.y);
  return {mark.left + (mark.width - label.size_px.x) / 2.0 + far * to.x,
          mark.top + (mark.height - label.size_px.y) / 2.0 + far * to.y, label.size_px.x,
          label.size_px.y};
}

}  // namespace

std::vector<Box> places_of(std::span<const PlacedLabel> labels, std::span<const Box> marks,
                           const Box& room) {
  constexpr double nearest_px = 4.0;
  constexpr double apart_px = 3.0;
  constexpr double farthest_px = 240.0;
  constexpr double step_px = 8.0;
  constexpr int directions = 16;
  constexpr double right_above = -std::numbers::pi / 4.0;
  std::vector<Box> places;
  const auto is_free = [&](const Box& box) {
    const Box spaced{box.left - apart_px, box.top - apart_px, box.width + 2.0 * apart_px,
                     box.height + 2.0 * apart_px};
    const auto covers = [&](const Box& other) { return overlap(spaced, other); };
    return holds(room, box) && std::ranges::none_of(marks, covers) &&
           std::ranges::none_of(places, covers);
  };
  const auto place_of = [&](const PlacedLabel& label) {
    for (double off = nearest_px; off <= farthest_px; off += step_px) {
      for (int k = 0; k < directions; ++k) {
        const Box box = beside(label, off, right_above + 2.0 * std::numbers::pi * k / directions);
        if (is_free(box)) {
          return box;
        }
      }
    }
    return beside(label, nearest_px, right_above);
  };
  for (const PlacedLabel& label : labels) {
    places.push_back(place_of(label));
  }
  return places;
}

}  // namespace palpate
