#include "misplaced_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/mat2x2.hpp>

#include "figures/axes.hpp"
#include "judged_belief.hpp"
#include "letters.hpp"
#include "palpate/pose_error.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

// One unknown of the experiment on misplaced touches, whose plain belief is too sure of
// the position; in others it is too sure of the angle.
constexpr std::uint64_t trial_seed = 500'000'000;
constexpr int trials_each = 1;
constexpr std::size_t shown_trial = 4;  ///< the U
constexpr int touches = 5;
constexpr SensorPoseNoise noise{.translation_mm = 1.0, .rotation_rad = 0.05};

constexpr double margin_px = 40.0;
constexpr double side_px = 520.0;
constexpr double axis_px = 84.0;
constexpr double top_px = 130.0;
constexpr double bar_px = top_px + side_px + 104.0;
constexpr double width_px = 2 * (margin_px + axis_px + side_px) + margin_px;
constexpr double height_px = bar_px + 96.0;
constexpr double half_view_mm = 4.0;  ///< about the true place
constexpr double decades = 6.0;       ///< of probability that colours tell apart

constexpr Pen truth_pen{.colour = {0.0, 0.55, 0.35}, .width_px = 4.0, .halo_px = 2.0};
constexpr Pen ellipse_pen{.colour = {0.0, 0.0, 0.0}, .width_px = 2.5, .halo_px = 2.0};

/// A belief after all touches, judged.
struct ShownBelief {
  RecognitionStep step;
  Marginals marginals;
  glm::dvec2 truth_mm;  ///< where the pivot truly lies in the object frame
};

ShownBelief believe(Device& device, const std::vector<Hypothesis>& letters, const Recording& trial,
                    const DisplacementSd& touch_sd) {
  // As --pivot-mm auto: x and y then hardly depend on the angle.
  PoseLattice lattice = lattice_of(60, 60, 113);
  lattice.pivot_mm = trial.T_robot_sensor.front().translation_mm;
  const RecognitionTask task(letters, HistogramOptions{.lattice = lattice, .touch_sd = touch_sd});
  PoseHistogram histogram = histogram_of(device, task);
  ShownBelief shown{.step = steps_after(histogram, task, trial, std::array{touches}).back(),
                    .marginals = {},
                    .truth_mm = trial.truth->T_object_robot * lattice.pivot_mm};
  shown.marginals = histogram.marginals(shown.step.mode.object);
  return shown;
}

/// Covariance of the pivot's place in the object frame, R(theta) p + t, to first order.
glm::dmat2 covariance_of_place(const RefinedPose& refined, const glm::dvec2& pivot_mm) {
  const glm::dvec2 lever = rotate(refined.T_object_robot.theta_rad, {-pivot_mm.y, pivot_mm.x});
  const std::array<double, 9>& c = refined.covariance;
  glm::dmat2 covariance;
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      covariance[i][j] =
          c[3 * i + j] + lever[i] * c[6 + j] + lever[j] * c[3 * i + 2] + lever[i] * lever[j] * c[8];
    }
  }
  return covariance;
}

/// Points about the pivot's refined place at two standard deviations of x and y together.
std::vector<glm::dvec2> ellipse_of(const glm::dvec2& place_mm, const glm::dmat2& covariance) {
  constexpr int corners = 72;
  constexpr double deviations = 2.0;
  // The Cholesky factor carries the circle to the ellipse.
  const double xx = std::sqrt(covariance[0][0]);
  const double yx = covariance[0][1] / xx;
  const double yy = std::sqrt(std::max(covariance[1][1] - yx * yx, 0.0));
  std::vector<glm::dvec2> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    const glm::dvec2 unit(std::cos(angle), std::sin(angle));
    points.push_back(place_mm + deviations * glm::dvec2(xx * unit.x, yx * unit.x + yy * unit.y));
  }
  return points;
}

void draw_cross(Canvas& canvas, const glm::dvec2& at) {
  for (const glm::dvec2& arm : {glm::dvec2(9.0, 9.0), glm::dvec2(9.0, -9.0)}) {
    const std::array ends{at - arm, at + arm};
    canvas.line(ends, truth_pen);
  }
}

/// Probability of a bin in powers of ten, from 0 to 1 over the scale.
double level_of(double probability, double largest) {
  return (std::log10(probability / largest) + decades) / decades;
}

void draw_belief(Canvas& canvas, const View& view, const ShownBelief& shown) {
  const PoseLattice& grid = shown.marginals.grid;
  const std::vector<double>& belief = shown.marginals.xy;
  const double largest = *std::ranges::max_element(belief);
  const Canvas::Clip clip(canvas, view.box);
  const Box whole =
      view.pixels({grid.x_mm.lower, grid.y_mm.lower}, {grid.x_mm.upper, grid.y_mm.upper});
  canvas.cells(whole, grid.x_mm.count, grid.y_mm.count, [&](int i, int j) {
    return sequential(level_of(belief[static_cast<std::size_t>(j) * grid.x_mm.count + i], largest));
  });
  std::vector<glm::dvec2> ellipse;
  const RefinedPose& refined = *shown.step.refined;
  for (const glm::dvec2& point : ellipse_of(refined.T_object_robot * grid.pivot_mm,
                                            covariance_of_place(refined, grid.pivot_mm))) {
    ellipse.push_back(view.pixel(point));
  }
  canvas.polygon(ellipse, ellipse_pen);
  draw_cross(canvas, view.pixel(shown.truth_mm));
}

void draw_panel(Canvas& canvas, double left_px, const std::string& title,
                const ShownBelief& shown) {
  const Box box{left_px, top_px, side_px, side_px};
  const glm::dvec2 half(half_view_mm);
  const View view{.box = box, .lower = shown.truth_mm - half, .upper = shown.truth_mm + half};
  draw_belief(canvas, view, shown);
  draw_axes(canvas, view, even_ticks(view.lower.x, view.upper.x, 7),
            even_ticks(view.lower.y, view.upper.y, 7),
            "x of the first touch in the object frame, mm", "y, mm");
  canvas.text(title, {left_px, top_px - 80.0}, heading);
  const glm::dmat2 covariance =
      covariance_of_place(*shown.step.refined, shown.marginals.grid.pivot_mm);
  canvas.text(fmt::format("error {:.1f} mm; standard deviations {:.1f} and {:.1f} mm",
                          *shown.step.refined_error_mm, std::sqrt(covariance[0][0]),
                          std::sqrt(covariance[1][1])),
              {left_px, top_px - 50.0}, small);
  const double legend_px = top_px - 22.0;
  draw_cross(canvas, {left_px + 12.0, legend_px - 6.0});
  canvas.text("true", {left_px + 32.0, legend_px}, small);
  canvas.circle({left_px + 106.0, legend_px - 6.0}, 11.0, ellipse_pen);
  canvas.text("refined pose, two standard deviations", {left_px + 128.0, legend_px}, small);
  draw_colour_bar(
      canvas, {left_px, bar_px, side_px, 20.0}, -decades, 0.0,
      [](double exponent) { return sequential((exponent + decades) / decades); },
      {{-6.0, "10⁻⁶"}, {-4.0, "10⁻⁴"}, {-2.0, "10⁻²"}, {0.0, "1"}},
      "probability relative to the largest, all angles");
}

}  // namespace

std::string draw_misplaced_unknown(Device& device, const std::vector<Hypothesis>& letters) {
  const Recording trial = make_trials(vowels, trials_each, touches, trial_seed,
                                      {.at_random_poses = true, .pose_noise = noise})[shown_trial];
  Canvas canvas(static_cast<int>(width_px), static_cast<int>(height_px));
  const double first_px = margin_px + axis_px;
  draw_panel(canvas, first_px, "Five touches taken as exact", believe(device, letters, trial, {}));
  draw_panel(canvas, first_px + side_px + margin_px + axis_px,
             "The same, each known to 1 mm and 3°",
             believe(device, letters, trial, {noise.translation_mm, noise.rotation_rad}));
  return canvas.encode();
}

}  // namespace palpate::bench
