#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/pose.hpp"

namespace palpate {

/// Contents of the picture of a plan, all in the robot frame.
struct PlanFigure {
  /// A touch that may come next.
  struct Candidate {
    Pose T_robot_sensor;
    double gain_nats = 0.0;
  };
  std::string result;                 ///< what is believed now, in large letters
  std::vector<std::string> captions;  ///< below; the first three are drawn
  std::string gain_caption;           ///< of the colour bar, such as "expected information, nats"

  // How probably each place is occupied, [ny, nx], cell (0, 0) with its corner at lower_mm.
  glm::dvec2 lower_mm{0.0};
  double cell_mm = 1.0;
  int nx = 0;
  int ny = 0;
  std::vector<double> occupied;

  std::vector<Candidate> candidates;    ///< the best one first
  std::vector<glm::dvec2> elements_mm;  ///< [e] of the candidates' array, in the sensor frame
  double element_mm = 1.8;              ///< edge at which an element is drawn
  std::vector<std::vector<glm::dvec2>> touches_mm;  ///< [touch][element] so far
};

/// Draws the candidates over the belief and returns the bytes of a PNG file. Greys show where the
/// object is expected; every candidate is a needle from the array's centre along the sensor's x
/// axis, in the colour of its gain; the best one is drawn with its elements, the touches so far as
/// faint outlines. The same contents give the same bytes.
/// @throws Error without a candidate, an element or a value for each cell, or lack of memory
std::string draw_plan(const PlanFigure& figure);

}  // namespace palpate
