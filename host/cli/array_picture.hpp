#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate::cli {

/// Finds the element of an array at a point of a picture. Elements are drawn as squares; their edge
/// is the distance of the two closest elements, 2 mm where there are no two. For e elements,
/// construction takes O(e log e) steps and a look-up O(log e).
class ArrayPicture {
 public:
  explicit ArrayPicture(const std::vector<glm::dvec2>& elements_mm);

  /// Corners of the box around all squares, in the sensor frame; both are 0 for an empty array.
  const glm::dvec2& lower_mm() const { return lower_mm_; }
  const glm::dvec2& upper_mm() const { return upper_mm_; }

  /// Index of the first element whose square covers this point of the sensor frame.
  std::optional<std::size_t> element_at(const glm::dvec2& p_mm) const;

 private:
  /// An element, and the row and column of its centre in a grid of cells as large as a square.
  struct Placed {
    double row = 0.0;  ///< a whole number, which may exceed the range of an int
    double column = 0.0;
    std::size_t element = 0;
    glm::dvec2 centre_mm{};
  };

  double row_of(double y_mm) const;
  double column_of(double x_mm) const;

  double half_mm_ = 1.0;
  glm::dvec2 lower_mm_{};
  glm::dvec2 upper_mm_{};
  std::vector<Placed> placed_;  ///< by row, then column
};

}  // namespace palpate::cli
