#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "figures/figures.hpp"
#include "figures/identity_panel.hpp"
#include "figures/label_places.hpp"
#include "figures/outlines.hpp"
#include "figures/view.hpp"
#include "model/bounding_box.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

namespace {

constexpr double side_px = 480.0;  ///< of every panel's plot
constexpr double gap_px = 40.0;    ///< between a plot and the next one's axis
constexpr double top_px = 256.0;   ///< of the plots
constexpr double bar_top_px = top_px + side_px + 104.0;
constexpr double bar_height_px = 20.0;
constexpr double height_px = bar_top_px + 96.0;
constexpr double width_px =
    margin_px + 3 * (axis_px + side_px) + 2 * gap_px + identity_labels_px + margin_px;

/// Element squares fade as they shrink, or they would hide the map below a large array.
constexpr double opaque_element_px = 80.0;
constexpr double smallest_element_px = 4.0;
/// The colour scale spans this many powers of ten below the largest probability.
constexpr double decades = 6.0;

constexpr Colour alarm{0.75, 0.1, 0.1};
constexpr Pen touch_pen{.colour = {0.0, 0.0, 0.0}, .width_px = 2.5, .halo_px = 1.5};
constexpr Pen mode_pen{.colour = {0.8, 0.475, 0.655}, .width_px = 2.5, .halo_px = 1.5};
constexpr Pen other_pen{
    .colour = {0.45, 0.2, 0.45}, .width_px = 2.0, .dashed = true, .halo_px = 1.5};
constexpr Pen truth_pen{
    .colour = {0.0, 0.55, 0.35}, .width_px = 2.5, .dashed = true, .halo_px = 1.5};

Box plot(int panel) {
  return {margin_px + axis_px + panel * (side_px + gap_px + axis_px), top_px, side_px, side_px};
}

Box bar(int panel) { return {plot(panel).left, bar_top_px, side_px, bar_height_px}; }

void draw_title(Canvas& canvas, const Box& plot, std::string_view title) {
  canvas.text(canvas.fit(title, plot.width, heading), {plot.left, top_px - 50.0}, heading);
}

/// Explains a panel's marks in a row below its title.
class Legend {
 public:
  Legend(Canvas& canvas, const Box& plot) : canvas_(canvas), x_(plot.left) {}

  /// Adds a mark of this width, which draw(centre) draws, and its meaning.
  template <typename Draw>
  void add(double mark_px, const Draw& draw, std::string_view meaning) {
    draw(glm::dvec2(x_ + mark_px / 2, baseline_px - 7.0));
    x_ += mark_px + 8.0;
    canvas_.text(meaning, {x_, baseline_px}, small);
    x_ += canvas_.text_width(meaning, small) + 20.0;
  }

 private:
  static constexpr double baseline_px = top_px - 16.0;
  Canvas& canvas_;
  double x_;
};

/// Draws the result in words with the title at its right, and the captions below.
void draw_captions(Canvas& canvas, const RecognitionSheet& sheet) {
  constexpr Font result{.size_px = 28.0, .bold = true};
  constexpr double first_px = 52.0;
  constexpr double below_px = 36.0;  ///< from the result to the first caption
  constexpr double row_px = 28.0;    ///< from caption to caption
  constexpr std::size_t most_captions = 4;
  constexpr double room_px = width_px - 2 * margin_px;
  const double title_px =
      std::min(canvas.text_width(sheet.title, heading), 0.2 * room_px - margin_px);
  const std::string words = canvas.fit(sheet.result, room_px - title_px - margin_px, result);
  canvas.text(words, {margin_px, first_px}, result);
  const double left_px = room_px - canvas.text_width(words, result) - margin_px;
  canvas.text(canvas.fit(sheet.title, left_px, heading), {width_px - margin_px, first_px}, heading,
              Align::right);
  double row = first_px + below_px;
  for (std::size_t i = 0; i < std::min(sheet.captions.size(), most_captions); ++i, row += row_px) {
    const RecognitionSheet::Caption& caption = sheet.captions[i];
    canvas.text(canvas.fit(caption.text, room_px, body), {margin_px, row}, body, Align::left,
                caption.alarm ? alarm : ink);
  }
}

/// Returns the true pose that the pose error compares with.
std::optional<Pose> nearest_truth(const RecognitionSheet& sheet) {
  if (!sheet.truth || sheet.map.symmetry == 1) {
    return sheet.truth;
  }
  return nearest_equal_pose(body_of(sheet.map), sheet.map.symmetry, sheet.T_object_robot,
                            *sheet.truth);
}

std::string meaning_of_truth(const RecognitionSheet& sheet, const std::string& meaning) {
  return sheet.map.symmetry == 1 ? meaning : meaning + ", by symmetry";
}

/// The corners of a box that a pose T_object_robot places, in the robot frame.
std::array<glm::dvec2, 4> placed(const BoundingBox& box, const Pose& T_object_robot) {
  const Pose T_robot_object = inverse(T_object_robot);
  return {T_robot_object * box.lower, T_robot_object * glm::dvec2(box.upper.x, box.lower.y),
          T_robot_object * box.upper, T_robot_object * glm::dvec2(box.lower.x, box.upper.y)};
}

/// Returns the view of a square of the robot frame that holds the map and all touches.
View view_around(const Box& box, const RecognitionSheet& sheet,
                 std::span<const Footprint> footprints, std::span<const glm::dvec2> truth) {
  BoundingBox part = bounding_box(
      placed({lower_edge_mm(sheet.map), upper_edge_mm(sheet.map)}, sheet.T_object_robot));
  for (const Footprint& f : footprints) {
    std::ranges::for_each(f.outline, [&](const glm::dvec2& corner) { part.take_in(corner); });
  }
  std::ranges::for_each(truth, [&](const glm::dvec2& corner) { part.take_in(corner); });
  const glm::dvec2 half(0.51 * std::max(part.extent().x, part.extent().y));
  return {.box = box, .lower = part.middle() - half, .upper = part.middle() + half};
}

/// Draws the ellipses that hold 68 and 95 % of a mode's x and y.
/// @returns the outer one, in pixels
std::vector<glm::dvec2> draw_ellipses(Canvas& canvas, const View& view, const ObjectPose& pose,
                                      const Pen& pen) {
  const double xx = pose.covariance[0];
  const double xy = pose.covariance[1];
  const double yy = pose.covariance[4];
  const double middle = (xx + yy) / 2.0;
  const double spread = std::hypot((xx - yy) / 2.0, xy);
  const double turn = 0.5 * std::atan2(2.0 * xy, xx - yy);
  std::vector<glm::dvec2> drawn;
  for (const double held : {0.68, 0.95}) {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - held));
    const glm::dvec2 axes =
        radius * glm::dvec2(std::sqrt(middle + spread), std::sqrt(std::max(middle - spread, 0.0)));
    std::vector<glm::dvec2> outline;
    constexpr int corners = 64;
    for (int k = 0; k < corners; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / corners;
      outline.push_back(pose.T_robot_object.translation_mm +
                        rotate(turn, axes * glm::dvec2(std::cos(angle), std::sin(angle))));
    }
    drawn = view.pixels(outline);
    canvas.polygon(drawn, pen);
  }
  return drawn;
}

Box box_around(std::span<const glm::dvec2> points) {
  const BoundingBox box = bounding_box(points);
  return {box.lower.x, box.lower.y, box.extent().x, box.extent().y};
}

/// Draws the modes, each with its name beside it where it is not the estimate's; a thin line leads
/// to a name that found no place there.
void draw_modes(Canvas& canvas, const View& view, const RecognitionSheet& sheet) {
  std::vector<Box> marks;
  std::vector<PlacedLabel> labels;
  std::vector<std::string> names;
  for (const RecognitionSheet::Mode& mode : sheet.modes) {
    marks.push_back(
        box_around(draw_ellipses(canvas, view, mode.pose, mode.own ? mode_pen : other_pen)));
    if (!mode.own && view.contains(mode.pose.T_robot_object.translation_mm)) {
      labels.push_back({marks.back(), {canvas.text_width(mode.name, small), small.size_px}});
      names.push_back(mode.name);
    }
  }
  constexpr Pen leader{.colour = other_pen.colour, .width_px = 1.0};
  constexpr double beside_px = 24.0;  // where the name speaks for itself
  const std::vector<Box> places = places_of(labels, marks, view.box);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Box& place = places[i];
    const Box& mark = labels[i].mark;
    const glm::dvec2 centre{mark.left + mark.width / 2.0, mark.top + mark.height / 2.0};
    const glm::dvec2 end = glm::clamp(centre, glm::dvec2(place.left, place.top),
                                      glm::dvec2(place.right(), place.bottom()));
    const glm::dvec2 begin =
        glm::clamp(end, glm::dvec2(mark.left, mark.top), glm::dvec2(mark.right(), mark.bottom()));
    if (glm::distance(begin, end) > beside_px) {
      canvas.segment(centre, end, leader);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Box& place = places[i];
    const std::array ground{glm::dvec2(place.left, place.top), glm::dvec2(place.right(), place.top),
                            glm::dvec2(place.right(), place.bottom()),
                            glm::dvec2(place.left, place.bottom())};
    canvas.fill(ground, {1.0, 1.0, 1.0, 0.8});
    canvas.text(names[i], {place.left, place.bottom() - 3.0}, small, Align::left, other_pen.colour);
  }
}

void draw_touches(Canvas& canvas, const RecognitionSheet& sheet) {
  std::vector<Footprint> footprints;
  for (const std::vector<glm::dvec2>& elements : sheet.footprints_mm) {
    footprints.push_back(footprint(elements, sheet.element_mm));
  }
  std::vector<std::vector<glm::dvec2>> actual;  // in the robot frame
  std::vector<glm::dvec2> corners;
  if (const std::optional<Pose> truth = nearest_truth(sheet)) {
    const Pose T_robot_object = inverse(*truth);
    for (std::vector<glm::dvec2> outline : outlines_of(sheet.map)) {
      std::ranges::transform(outline, outline.begin(),
                             [&](const glm::dvec2& p) { return T_robot_object * p; });
      corners.insert(corners.end(), outline.begin(), outline.end());
      actual.push_back(std::move(outline));
    }
  }
  const View view = view_around(plot(0), sheet, footprints, corners);
  const EvidenceScale scale = evidence_scale(std::span(&sheet.map, 1));
  {
    const Canvas::Clip clip(canvas, view.box);
    draw_cells(canvas, view, sheet.map, scale, sheet.T_object_robot);
    const double element_px = sheet.element_mm * view.box.width / (view.upper.x - view.lower.x);
    const double alpha = std::min(element_px / opaque_element_px, 0.25);
    for (const Footprint& f : footprints) {
      if (element_px >= smallest_element_px) {
        for (const auto& square : f.elements) {
          canvas.polygon(view.pixels(square), {.colour = {0.0, 0.0, 0.0, alpha}, .width_px = 0.75});
        }
      }
    }
    for (const Footprint& f : footprints) {
      canvas.polygon(view.pixels(f.outline), touch_pen);
    }
    draw_modes(canvas, view, sheet);
    for (const std::vector<glm::dvec2>& outline : actual) {
      canvas.polygon(view.pixels(outline), truth_pen);
    }
  }
  draw_axes(canvas, view, even_ticks(view.lower.x, view.upper.x, 7),
            even_ticks(view.lower.y, view.upper.y, 7), "x in the robot frame, mm", "y, mm");
  draw_evidence_bar(canvas, bar(0), scale);

  draw_title(canvas, view.box, "Map of " + sheet.map.label + " in the robot frame");
  Legend legend(canvas, view.box);
  const auto sample = [&](const Pen& pen) {
    return [&canvas, &pen](glm::dvec2 at) {
      canvas.segment(at - glm::dvec2(18.0, 0.0), at + glm::dvec2(18.0, 0.0), pen);
    };
  };
  legend.add(36.0, sample(touch_pen), "touches");
  if (!sheet.modes.empty()) {
    legend.add(36.0, sample(mode_pen), "68, 95 %");
  }
  if (!actual.empty()) {
    legend.add(36.0, sample(truth_pen), meaning_of_truth(sheet, "true outline"));
  }
}

void draw_ring(Canvas& canvas, glm::dvec2 at) { canvas.circle(at, 11.0, touch_pen); }

void draw_cross(Canvas& canvas, glm::dvec2 at) {
  Pen pen = truth_pen;
  pen.dashed = false;
  for (const glm::dvec2& arm : {glm::dvec2(7.0, 7.0), glm::dvec2(7.0, -7.0)}) {
    canvas.segment(at - arm, at + arm, pen);
  }
}

std::string power_of_ten(int exponent) {
  static constexpr std::array digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "10⁻" : "10";
  for (const char digit : std::to_string(std::abs(exponent))) {
    text += digits[static_cast<std::size_t>(digit - '0')];
  }
  return exponent == 0 ? "1" : text;
}

void draw_belief(Canvas& canvas, const RecognitionSheet& sheet) {
  const PlacedBelief& belief = sheet.belief;
  const View view{.box = plot(1),
                  .lower = belief.lower_mm,
                  .upper = belief.lower_mm + glm::dvec2(belief.cells * belief.cell_mm)};

  const double largest = *std::ranges::max_element(belief.xy);
  const double top = largest > 0.0 ? std::ceil(std::log10(largest)) : 0.0;
  const auto colour = [&](double log10_p) {
    return sequential((log10_p - top + decades) / decades);
  };
  canvas.cells(view.box, belief.cells, belief.cells, [&](int i, int j) {
    return colour(std::log10(belief.xy[static_cast<std::size_t>(j) * belief.cells + i]));
  });
  {
    const Canvas::Clip clip(canvas, view.box);
    for (const RecognitionSheet::Mode& mode : sheet.modes) {
      if (mode.own) {
        draw_ellipses(canvas, view, mode.pose, mode_pen);
      }
    }
  }
  draw_axes(canvas, view, even_ticks(view.lower.x, view.upper.x, 7),
            even_ticks(view.lower.y, view.upper.y, 7), "x of the object in the robot frame, mm",
            "y, mm");
  std::vector<Tick> ticks;
  for (double exponent = top - decades; exponent <= top; exponent += 2.0) {
    ticks.push_back({exponent, power_of_ten(static_cast<int>(exponent))});
  }
  ticks.front().label = "≤ " + ticks.front().label;
  draw_colour_bar(canvas, bar(1), top - decades, top, colour, ticks,
                  "probability per cell, all angles");

  draw_title(canvas, view.box, "Where is it? Belief over position");
  Legend legend(canvas, view.box);
  const auto mark = [&](const Pose& T_object_robot, auto draw, std::string meaning) {
    const glm::dvec2 origin = inverse(T_object_robot).translation_mm;
    if (view.contains(origin)) {
      draw(canvas, view.pixel(origin));
    } else {
      meaning += " (outside)";
    }
    legend.add(
        26.0, [&](glm::dvec2 at) { draw(canvas, at); }, meaning);
  };
  mark(sheet.T_object_robot, draw_ring, "estimated");
  if (const std::optional<Pose> truth = nearest_truth(sheet)) {
    mark(*truth, draw_cross, meaning_of_truth(sheet, "true"));
  }
}

}  // namespace

std::string draw_recognition(const RecognitionSheet& sheet) {
  Canvas canvas(static_cast<int>(width_px), static_cast<int>(height_px));
  draw_captions(canvas, sheet);
  draw_touches(canvas, sheet);
  draw_belief(canvas, sheet);
  draw_title(canvas, plot(2), "What is it? Belief over identity");
  draw_identity(canvas, plot(2), sheet.labels, sheet.identity);
  return canvas.encode();
}

}  // namespace palpate
