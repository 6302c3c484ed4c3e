#include "figures/axes.hpp"

#include <algorithm>

namespace palpate {

namespace {

constexpr double tick_px = 6.0;
constexpr Pen axis_pen{.colour = ink, .width_px = 1.5};

}  // namespace

glm::dvec2 View::pixel(glm::dvec2 data) const {
  const glm::dvec2 share = (data - lower) / (upper - lower);
  return {box.left + share.x * box.width, box.bottom() - share.y * box.height};
}

Box View::pixels(glm::dvec2 data_lower, glm::dvec2 data_upper) const {
  const glm::dvec2 bottom_left = pixel(data_lower);
  const glm::dvec2 top_right = pixel(data_upper);
  return {bottom_left.x, top_right.y, top_right.x - bottom_left.x, bottom_left.y - top_right.y};
}

std::vector<glm::dvec2> View::pixels(std::span<const glm::dvec2> data) const {
  std::vector<glm::dvec2> points;
  for (const glm::dvec2& p : data) {
    points.push_back(pixel(p));
  }
  return points;
}

bool View::contains(glm::dvec2 data) const {
  return data.x >= lower.x && data.x <= upper.x && data.y >= lower.y && data.y <= upper.y;
}

void draw_axes(Canvas& canvas, const View& view, const std::vector<Tick>& x_ticks,
               const std::vector<Tick>& y_ticks, std::string_view x_label,
               std::string_view y_label) {
  const Box& box = view.box;
  canvas.frame(box, axis_pen);
  for (const Tick& tick : x_ticks) {
    const double x = view.pixel({tick.value, view.lower.y}).x;
    canvas.segment({x, box.bottom()}, {x, box.bottom() + tick_px}, axis_pen);
    canvas.text(tick.label, {x, box.bottom() + tick_px + small.size_px}, small, Align::centre);
  }
  double widest = 0.0;
  for (const Tick& tick : y_ticks) {
    widest = std::max(widest, canvas.text_width(tick.label, small));
    const double y = view.pixel({view.lower.x, tick.value}).y;
    canvas.segment({box.left - tick_px, y}, {box.left, y}, axis_pen);
    canvas.text(tick.label, {box.left - tick_px - 4.0, y + small.half_height_px()}, small,
                Align::right);
  }
  canvas.text(x_label, {box.left + box.width / 2, box.bottom() + 54.0}, body, Align::centre);
  canvas.text_upwards(y_label, {box.left - std::max(64.0, widest + 22.0), box.top + box.height / 2},
                      body, Align::centre);
}

void draw_colour_bar(Canvas& canvas, const Box& box, double lower, double upper,
                     const std::function<Colour(double value)>& colour,
                     const std::vector<Tick>& ticks, std::string_view caption) {
  const int shades = static_cast<int>(box.width);
  canvas.cells(box, shades, 1,
               [&](int i, int) { return colour(lower + (upper - lower) * (i + 0.5) / shades); });
  canvas.frame(box, axis_pen);
  for (const Tick& tick : ticks) {
    const double x = box.left + box.width * (tick.value - lower) / (upper - lower);
    canvas.segment({x, box.bottom()}, {x, box.bottom() + tick_px}, axis_pen);
    canvas.text(tick.label, {x, box.bottom() + tick_px + small.size_px}, small, Align::centre);
  }
  canvas.text(caption, {box.left + box.width / 2, box.bottom() + 52.0}, body, Align::centre);
}

}  // namespace palpate
