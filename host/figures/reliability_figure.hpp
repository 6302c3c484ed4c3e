#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace palpate {

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
