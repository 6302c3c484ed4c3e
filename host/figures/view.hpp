#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/canvas.hpp"
#include "figures/evidence_scale.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// A labelled value on an axis.
struct Tick {
  double value = 0.0;
  std::string label;
};

/// Returns the number in its shortest form, to six digits, with a true minus sign.
std::string number(double value);

/// Returns at most `count` + 1 ticks within [lower, upper]. Their step is 1, 2 or 5 times a power
/// of ten and at least `smallest_step`.
std::vector<Tick> even_ticks(double lower, double upper, int count, double smallest_step = 0.0);

/// A rectangle of data coordinates, y up, and the box on the canvas that shows it.
struct View {
  Box box;
  glm::dvec2 lower{0.0, 0.0};
  glm::dvec2 upper{1.0, 1.0};

  glm::dvec2 pixel(glm::dvec2 data) const;
  /// Returns the box in pixels of a rectangle of data.
  Box pixels(glm::dvec2 data_lower, glm::dvec2 data_upper) const;
  /// Returns the pixels of points of data.
  std::vector<glm::dvec2> pixels(std::span<const glm::dvec2> data) const;
  bool contains(glm::dvec2 data) const;
};

inline constexpr double margin_px = 40.0;  ///< around a picture
inline constexpr double axis_px = 84.0;    ///< to the left of a plot

inline constexpr Font body{20.0};
inline constexpr Font small{18.0};
inline constexpr Font heading{24.0, true};

/// Draws a frame around the view, with ticks and axis labels on its left and below it. They take 60
/// pixels below, and on the left 84 or as many as the widest tick label needs.
void draw_axes(Canvas& canvas, const View& view, const std::vector<Tick>& x_ticks,
               const std::vector<Tick>& y_ticks, std::string_view x_label,
               std::string_view y_label);

/// Draws a horizontal colour bar of [lower, upper] with ticks and a caption, which take 56 pixels
/// below.
void draw_colour_bar(Canvas& canvas, const Box& box, double lower, double upper,
                     const std::function<Colour(double value)>& colour,
                     const std::vector<Tick>& ticks, std::string_view caption);

/// Returns a corner of the area that the map's cells cover, in mm in the object frame.
glm::dvec2 lower_edge_mm(const OccupancyGrid& map);
glm::dvec2 upper_edge_mm(const OccupancyGrid& map);

/// Draws the map in a view of its own frame.
void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale);

/// Draws the map in a view of another frame; white beyond it.
void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale, const Pose& T_map_view);

/// Draws the scale's colour bar, with words for its ends above. It takes 26 pixels above the box
/// and 56 below it.
void draw_evidence_bar(Canvas& canvas, const Box& box, const EvidenceScale& scale);

}  // namespace palpate
