#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/placed_belief.hpp"
#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Draws maps side by side at one scale and returns the bytes of a PNG file. Colours show log odds
/// relative to each map's prior (white = prior, blue = empty, red = occupied); one colour bar in
/// nats serves all, and each has axes in mm. y points up. The same maps give the same bytes.
/// @throws Error on an empty list, a map without cells, or lack of memory
std::string draw_maps(std::span<const OccupancyGrid> maps);

/// Contents of one recognised object's sheet.
struct RecognitionSheet {
  struct Caption {
    std::string text;
    bool alarm = false;  ///< in red
  };
  std::string title;   ///< such as the recording's file name
  std::string result;  ///< the object and its pose in words; stands first, in large letters
  std::vector<Caption> captions = {};                  ///< below; the first four are drawn
  OccupancyGrid map;                                   ///< of the estimated object
  std::vector<std::vector<glm::dvec2>> footprints_mm;  ///< [touch][element] in the robot frame
  double element_mm = 1.8;                             ///< edge at which an element is drawn
  Pose T_object_robot;                                 ///< estimated
  std::optional<Pose> truth;  ///< T_object_robot, if known and the identity is right
  PlacedBelief belief;        ///< of the estimated object
  /// Where the belief lies, of any object.
  struct Mode {
    std::string name;  ///< such as "E 97.9 %"
    ObjectPose pose;
    bool own = false;  ///< of the estimated pose
  };
  std::vector<Mode> modes = {};
  std::vector<std::string> labels;            ///< [object]; equal labels are drawn as one, summed
  std::vector<std::vector<double>> identity;  ///< [touch][object] probability after each touch
};

/// Draws a sheet and returns the bytes of a PNG file: in the robot frame, the map at the estimated
/// pose, the sensor's footprints and the modes with the ellipses that hold 68 and 95 % of their x
/// and y; the belief over where T_robot_object's origin lies; and the identity probabilities over
/// the touches. For a symmetric object, the true pose drawn is the one nearest to the estimate. The
/// same sheet gives the same bytes.
/// @throws Error on a map without cells, arrays of the wrong size, a symmetric object with a truth
/// but without an occupied cell, or lack of memory
std::string draw_recognition(const RecognitionSheet& sheet);

/// A press as it lies on a map.
struct DrawnPress {
  std::string caption;
  std::vector<glm::dvec2> contacts_mm;  ///< centres of its elements In Contact, in the object frame
  double theta_rad = 0.0;               ///< by which its elements are turned
  double element_mm = 1.8;              ///< edge at which an element is drawn
};

/// A map and the presses that it was built from; without a map, presses by themselves.
struct DrawnPresses {
  std::string title;
  std::optional<OccupancyGrid> map = {};
  std::vector<DrawnPress> presses;
};

/// Draws each map alone and then, at the same scale and place, under each of its presses, whose
/// elements In Contact are squares: a press lies well where its squares cover what is red. Returns
/// the bytes of a PNG file; the same groups give the same bytes.
/// @throws Error on an empty list, a map without cells, or lack of memory
std::string draw_presses(std::span<const DrawnPresses> groups);

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

/// Contents of the picture of a confusion matrix.
struct ConfusionFigure {
  struct Row {
    std::string name;                 ///< of the true class
    std::string right;                ///< the column that is right; may be none of them
    std::vector<std::size_t> counts;  ///< [column]
    std::vector<double> proven;       ///< [column] lower 95 % bound of the share of the row
  };
  std::string title;
  std::vector<std::string> columns;  ///< the answers
  std::vector<Row> rows;
};

/// Draws the matrix and returns the bytes of a PNG file: the first row on top, every count in its
/// cell, the right ones on blue and the wrong ones on red, the darker the larger the share that is
/// proven: one record of one is no dark cell. Where there are too many classes for numbers, the
/// cells have only their colours. The same contents give the same bytes.
/// @throws Error without a row or a column, where a row has not one count and one share for each
/// column, or for lack of memory
std::string draw_confusion(const ConfusionFigure& figure);

/// Contents of a reliability diagram.
struct ReliabilityFigure {
  /// Results of about one confidence.
  struct Point {
    double confidence = 0.0;  ///< mean probability of the best label
    double accuracy = 0.0;    ///< share that is right
    double low = 0.0;         ///< interval of the accuracy
    double high = 0.0;
    std::size_t records = 0;  ///< written beside the point
  };
  struct Curve {
    std::string name;
    std::vector<Point> points;
  };
  std::vector<Curve> curves;  ///< at most series_colours
};

/// Draws accuracy over confidence, with a dotted line where they are equal, and returns the bytes
/// of a PNG file. The same contents give the same bytes.
/// @throws Error (Fault::system) where Cairo fails
std::string draw_reliability(const ReliabilityFigure& figure);

}  // namespace palpate
