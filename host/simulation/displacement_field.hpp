#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "palpate/pose.hpp"
#include "palpate/simulation.hpp"

namespace palpate {

/// A shape's displacement map convolved with a Gaussian point spread: 1 deep inside the shape, 0
/// far from it, on a grid in the object frame.
class DisplacementField {
 public:
  /// @param psf_mm standard deviation of the point spread; 0 leaves the shape sharp
  /// @throws Error on a point that is not finite or more than 1 km from the origin, or a shape
  /// without area
  DisplacementField(const Shape& shape, double psf_mm);

  /// Returns the field's mean over a square of this edge, centred at the element frame's origin.
  double mean(const Pose& T_object_element, double edge_mm) const;

 private:
  double& cell(int i, int j) { return values_[static_cast<std::size_t>(j) * nx_ + i]; }
  double cell(int i, int j) const { return values_[static_cast<std::size_t>(j) * nx_ + i]; }
  void rasterize(const Shape& shape);
  void blur(double psf_mm);
  double interpolate(const glm::dvec2& p_object_mm) const;

  double cell_mm_ = 0.1;
  glm::dvec2 lower_mm_{0.0, 0.0};  ///< lower left corner of cell (0, 0)
  int nx_ = 0;
  int ny_ = 0;
  std::vector<double> values_;  ///< [ny, nx]
};

}  // namespace palpate
