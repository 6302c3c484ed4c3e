#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate::cli {

/// Where the elements of an array are, to be drawn as squares as wide as the closest two are apart.
/// Made in e log e steps for e elements, asked in log e.
class ArrayPicture {
 public:
  explicit ArrayPicture(const std::vector<glm::dvec2>& elements_mm);

  /// Corners of the area that the squares cover; no area where there is no element.
  const glm::dvec2& lower_mm() const { return lower_mm_; }
  const glm::dvec2& upper_mm() const { return upper_mm_; }

  /// The element that covers this point of the sensor frame, the first of several.
  std::optional<std::size_t> element_at(const glm::dvec2& p_mm) const;

 private:
  /// An element in the square cell, as wide as an element, that its centre lies in.
  struct Placed {
    double row = 0.0;  ///< a whole number; an array may be wider than an int can count
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
