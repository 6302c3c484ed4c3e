#include <algorithm>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "figures/axes.hpp"
#include "figures/figures.hpp"
#include "figures/footprint.hpp"
#include "palpate/error.hpp"
#include "palpate/touch.hpp"

namespace palpate {

namespace {

constexpr double margin_px = 40.0;
constexpr double axis_px = 84.0;
constexpr double longest_px = 760.0;  ///< of the plot's longer side
constexpr double narrowest_px = 620.0;
constexpr double top_px = 214.0;
constexpr double bar_below_px = 104.0;
constexpr double bar_height_px = 20.0;
constexpr double below_bar_px = 90.0;
constexpr double needle_px = 18.0;

constexpr Pen touch_pen{.colour = {0.35, 0.35, 0.35, 0.75}, .width_px = 1.5, .dashed = true};
constexpr Pen best_pen{.colour = {0.80, 0.05, 0.30}, .width_px = 4.0, .halo_px = 2.0};

void validate(const PlanFigure& figure) {
  if (figure.candidates.empty() || figure.elements_mm.empty()) {
    throw Error(Fault::input, fmt::format("picture of a plan: {} candidates of {} elements; give "
                                          "at least one of each",
                                          figure.candidates.size(), figure.elements_mm.size()));
  }
  const auto cells = static_cast<std::size_t>(std::max(figure.nx, 0)) *
                     static_cast<std::size_t>(std::max(figure.ny, 0));
  if (cells == 0 || figure.occupied.size() != cells) {
    throw Error(Fault::input, fmt::format("picture of a plan: {} values for {} x {} cells; give "
                                          "one for each",
                                          figure.occupied.size(), figure.nx, figure.ny));
  }
}

/// White to dark grey: colours are for the gains.
Colour occupancy_colour(double probability) {
  const double shade = 1.0 - 0.55 * std::clamp(probability, 0.0, 1.0);
  return {shade, shade, shade};
}

View view_of(const PlanFigure& figure) {
  const glm::dvec2 extent = figure.cell_mm * glm::dvec2(figure.nx, figure.ny);
  const double px_per_mm = longest_px / std::max(extent.x, extent.y);
  return {.box = {margin_px + axis_px, top_px, px_per_mm * extent.x, px_per_mm * extent.y},
          .lower = figure.lower_mm,
          .upper = figure.lower_mm + extent};
}

std::vector<glm::dvec2> placed(std::span<const glm::dvec2> elements_mm,
                               const Pose& T_robot_sensor) {
  std::vector<glm::dvec2> result;
  for (const glm::dvec2& element : elements_mm) {
    result.push_back(T_robot_sensor * element);
  }
  return result;
}

/// The gains' colours: from the least to the largest, an empty range widened.
struct GainScale {
  double lower = 0.0;
  double upper = 1.0;

  explicit GainScale(const PlanFigure& figure) {
    const auto [least, most] =
        std::ranges::minmax_element(figure.candidates, {}, &PlanFigure::Candidate::gain_nats);
    lower = least->gain_nats;
    upper = std::max(most->gain_nats, lower + 1e-3);
  }
  Colour colour(double gain) const { return sequential((gain - lower) / (upper - lower)); }
};

void draw_needle(Canvas& canvas, const View& view, const PlanFigure& figure,
                 const PlanFigure::Candidate& candidate, const Colour& colour) {
  const glm::dvec2 centre =
      view.pixel(candidate.T_robot_sensor * array_centre_mm(figure.elements_mm));
  const double theta = candidate.T_robot_sensor.theta_rad;
  canvas.segment(centre, centre + needle_px * glm::dvec2(std::cos(theta), -std::sin(theta)),
                 {.colour = colour, .width_px = 4.0, .halo_px = 0.75});
  canvas.disc(centre, 3.0, colour);
}

void draw_legend(Canvas& canvas, double baseline) {
  double x = margin_px + axis_px;
  const auto meaning = [&](std::string_view words) {
    canvas.text(words, {x, baseline}, small);
    x += canvas.text_width(words, small) + 22.0;
  };
  const auto stroke = [&](const Pen& pen) {
    canvas.segment(glm::dvec2(x, baseline - 6.0), glm::dvec2(x + 30.0, baseline - 6.0), pen);
    x += 38.0;
  };
  stroke(best_pen);
  meaning("best next touch");
  stroke(touch_pen);
  meaning("touches so far");
  const Colour shade = sequential(0.6);
  canvas.disc({x + 4.0, baseline - 6.0}, 3.0, shade);
  canvas.segment(glm::dvec2(x + 4.0, baseline - 6.0), glm::dvec2(x + 19.0, baseline - 6.0),
                 {.colour = shade, .width_px = 4.0});
  x += 28.0;
  meaning("candidates, along x");
  const Box box{x, baseline - 14.0, 26.0, 16.0};
  canvas.cells(box, 1, 1, [](int, int) { return occupancy_colour(1.0); });
  x += 34.0;
  meaning("object");
}

}  // namespace

std::string draw_plan(const PlanFigure& figure) {
  validate(figure);
  const View view = view_of(figure);
  const GainScale scale(figure);
  const double bar_top = view.box.bottom() + bar_below_px;
  const double room = std::max(view.box.width, narrowest_px + 160.0);
  Canvas canvas(static_cast<int>(margin_px + axis_px + room + margin_px),
                static_cast<int>(bar_top + bar_height_px + below_bar_px));
  constexpr Font large{.size_px = 26.0, .bold = true};
  const double words_px = room + axis_px;
  canvas.text(canvas.fit(figure.result, words_px, large), {margin_px, 52.0}, large);
  double row = 88.0;
  for (std::size_t i = 0; i < std::min<std::size_t>(figure.captions.size(), 3); ++i, row += 28.0) {
    canvas.text(canvas.fit(figure.captions[i], words_px, body), {margin_px, row}, body);
  }
  draw_legend(canvas, top_px - 18.0);
  {
    const Canvas::Clip clip(canvas, view.box);
    canvas.cells(view.box, figure.nx, figure.ny, [&](int i, int j) {
      return occupancy_colour(figure.occupied[static_cast<std::size_t>(j) * figure.nx + i]);
    });
    for (const std::vector<glm::dvec2>& touch : figure.touches_mm) {
      canvas.polygon(view.pixels(footprint(touch, figure.element_mm).outline), touch_pen);
    }
    // The best come last, on top.
    for (std::size_t i = figure.candidates.size(); i-- > 0;) {
      const PlanFigure::Candidate& candidate = figure.candidates[i];
      draw_needle(canvas, view, figure, candidate, scale.colour(candidate.gain_nats));
    }
    const PlanFigure::Candidate& best = figure.candidates.front();
    const Footprint array =
        footprint(placed(figure.elements_mm, best.T_robot_sensor), figure.element_mm);
    for (const auto& square : array.elements) {
      canvas.polygon(view.pixels(square), {.colour = {0.80, 0.05, 0.30, 0.45}, .width_px = 1.0});
    }
    canvas.polygon(view.pixels(array.outline), best_pen);
  }
  draw_axes(canvas, view, even_ticks(view.lower.x, view.upper.x, 8),
            even_ticks(view.lower.y, view.upper.y, 8), "x in the robot frame, mm", "y, mm");
  draw_colour_bar(
      canvas, {view.box.left, bar_top, view.box.width, bar_height_px}, scale.lower, scale.upper,
      [&](double gain) { return scale.colour(gain); }, even_ticks(scale.lower, scale.upper, 6),
      figure.gain_caption);
  return canvas.encode();
}

}  // namespace palpate
