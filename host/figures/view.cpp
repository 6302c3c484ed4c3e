#include "figures/view.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace palpate {

namespace {

constexpr double tick_px = 6.0;
constexpr Pen axis_pen{.colour = ink, .width_px = 1.5};

/// Draws a frame around the view, and ticks with their labels below it.
void draw_x_axis(Canvas& canvas, const View& view, const std::vector<Tick>& ticks) {
  canvas.frame(view.box, axis_pen);
  const double bottom = view.box.bottom();
  for (const Tick& tick : ticks) {
    const double x = view.pixel({tick.value, view.lower.y}).x;
    canvas.segment({x, bottom}, {x, bottom + tick_px}, axis_pen);
    canvas.text(tick.label, {x, bottom + tick_px + small.size_px}, small, Align::centre);
  }
}

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
  draw_x_axis(canvas, view, x_ticks);
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
  draw_x_axis(canvas, {.box = box, .lower = {lower, 0.0}, .upper = {upper, 1.0}}, ticks);
  canvas.text(caption, {box.left + box.width / 2, box.bottom() + 52.0}, body, Align::centre);
}

std::string number(double value) {
  std::string text = fmt::format("{:g}", value);
  if (text.front() == '-') {
    text.replace(0, 1, "−");
  }
  return text;
}

std::vector<Tick> even_ticks(double lower, double upper, int count, double smallest_step) {
  const double width = (upper - lower) / count;
  const double decade = std::pow(10.0, std::floor(std::log10(width)));
  double step = 10.0 * decade;
  for (const double factor : {5.0, 2.0, 1.0}) {
    // The margin keeps a width that is itself a step from being rounded up to the next one.
    if (factor * decade >= width * (1.0 - 1e-9)) {
      step = factor * decade;
    }
  }
  step = std::max(step, smallest_step);

  const double margin = 1e-9 * (upper - lower);
  std::vector<Tick> ticks;
  const double first = std::ceil((lower - margin) / step);
  for (int k = 0; k <= count && (first + k) * step <= upper + margin; ++k) {
    const double value = (first + k) * step + 0.0;  // adding zero turns -0 into 0
    ticks.push_back({value, number(value)});
  }
  return ticks;
}

glm::dvec2 lower_edge_mm(const OccupancyGrid& map) { return map.origin_mm - 0.5 * map.cell_mm; }

glm::dvec2 upper_edge_mm(const OccupancyGrid& map) {
  return lower_edge_mm(map) + map.cell_mm * glm::dvec2(map.nx, map.ny);
}

void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale) {
  const double prior = map.prior_log_odds();
  canvas.cells(view.pixels(lower_edge_mm(map), upper_edge_mm(map)), map.nx, map.ny,
               [&](int i, int j) { return scale.colour(map.at(i, j) - prior); });
}

void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale, const Pose& T_map_view) {
  const auto across = static_cast<int>(view.box.width);
  const auto up = static_cast<int>(view.box.height);
  const double prior = map.prior_log_odds();
  const auto cell_at = [&](double x, double y) {
    return (T_map_view * glm::dvec2(x, y) - map.origin_mm) / map.cell_mm;
  };
  const glm::dvec2 first = cell_at(view.lower.x, view.lower.y);
  const glm::dvec2 along_x = (cell_at(view.upper.x, view.lower.y) - first) / (1.0 * across);
  const glm::dvec2 along_y = (cell_at(view.lower.x, view.upper.y) - first) / (1.0 * up);
  canvas.cells(view.box, across, up, [&](int u, int v) {
    const glm::dvec2 cell = first + (u + 0.5) * along_x + (v + 0.5) * along_y;
    const auto i = static_cast<int>(std::lround(std::clamp(cell.x, -1.0, 1.0 * map.nx)));
    const auto j = static_cast<int>(std::lround(std::clamp(cell.y, -1.0, 1.0 * map.ny)));
    const bool inside = i >= 0 && j >= 0 && i < map.nx && j < map.ny;
    return inside ? scale.colour(map.at(i, j) - prior) : white;
  });
}

void draw_evidence_bar(Canvas& canvas, const Box& box, const EvidenceScale& scale) {
  const double range = scale.range_nats;
  draw_colour_bar(
      canvas, box, -range, range, [&](double nats) { return scale.colour(nats); },
      {{-range, "≤ " + number(-range)},
       {-range / 2, number(-range / 2)},
       {0.0, "prior"},
       {range / 2, "+" + number(range / 2)},
       {range, "≥ +" + number(range)}},
      "log odds relative to the prior, nats");
  const double words = box.top - 9.0;
  canvas.text("← empty", {box.left, words}, body);
  canvas.text("unseen", {box.left + box.width / 2, words}, body, Align::centre);
  canvas.text("occupied →", {box.right(), words}, body, Align::right);
}

}  // namespace palpate
