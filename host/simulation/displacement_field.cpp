#include "simulation/displacement_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "model/bounding_box.hpp"
#include "palpate/error.hpp"
#include "simulation/spans.hpp"

namespace palpate {

namespace {

/// Radius at which the point spread is cut off, in standard deviations: 6e-7 of it lies beyond.
constexpr double reach = 5.0;

BoundingBox bounds(const Shape& shape) {
  // 1 km: far beyond any object, yet rounding does not swallow a cell there.
  constexpr double farthest_mm = 1e6;
  BoundingBox box;
  const auto include = [&](const glm::dvec2& p, double width_mm) {
    // Written so that NaN is refused.
    if (!(std::abs(p.x) <= farthest_mm && std::abs(p.y) <= farthest_mm && width_mm >= 0.0 &&
          width_mm <= farthest_mm)) {
      throw Error(
          Fault::input,
          fmt::format("shape '{}': point {},{} of a line {} mm wide: give coordinates within "
                      "{} mm of 0 and a width that is not negative",
                      shape.label, p.x, p.y, width_mm, farthest_mm));
    }
    box.take_in(p - width_mm / 2.0);
    box.take_in(p + width_mm / 2.0);
  };
  for (const Shape::Stroke& stroke : shape.strokes) {
    for (const glm::dvec2& p : stroke.points_mm) {
      include(p, stroke.width_mm);
    }
  }
  for (const std::vector<glm::dvec2>& polygon : shape.polygons) {
    for (const glm::dvec2& p : polygon) {
      include(p, 0.0);
    }
  }
  return box;
}

}  // namespace

DisplacementField::DisplacementField(const Shape& shape, double psf_mm) {
  const BoundingBox box = bounds(shape);
  if (!(box.lower.x < box.upper.x && box.lower.y < box.upper.y)) {
    throw Error(Fault::input,
                fmt::format("shape '{}': covers no area, so it cannot be touched", shape.label));
  }
  const glm::dvec2 extent = box.extent() + 2.0 * reach * psf_mm;
  // Cells of 0.1 mm suffice for this sensor. They are larger where a large shape would need more
  // than 2000 x 2000 cells, or where the point spread hides smaller ones.
  cell_mm_ = std::max({0.1, std::max(extent.x, extent.y) / 2000.0, psf_mm / 20.0});
  const double margin_mm = reach * psf_mm + cell_mm_;
  lower_mm_ = box.lower - margin_mm;
  nx_ = static_cast<int>(std::ceil((box.upper.x + margin_mm - lower_mm_.x) / cell_mm_));
  ny_ = static_cast<int>(std::ceil((box.upper.y + margin_mm - lower_mm_.y) / cell_mm_));
  values_.assign(static_cast<std::size_t>(nx_) * ny_, 0.0);
  rasterize(shape);
  if (psf_mm > 0.0) {
    blur(psf_mm);
  }
}

/// Computes the covered part of every cell: exactly along x, on 8 lines per cell along y.
void DisplacementField::rasterize(const Shape& shape) {
  constexpr int lines = 8;
  for (int line = 0; line < lines * ny_; ++line) {
    const double y_mm = lower_mm_.y + (line + 0.5) / lines * cell_mm_;
    for (const Span& span : spans(shape, y_mm)) {
      const double begin = (span.begin - lower_mm_.x) / cell_mm_;
      const double end = (span.end - lower_mm_.x) / cell_mm_;
      for (int i = static_cast<int>(begin); i < end; ++i) {
        cell(i, line / lines) += (std::min(end, i + 1.0) - std::max(begin, i + 0.0)) / lines;
      }
    }
  }
}

void DisplacementField::blur(double psf_mm) {
  // Weights are the Gaussian's integrals over the cells, not its values at their centres: these
  // would be wrong where the point spread is narrower than a cell.
  const int radius = static_cast<int>(std::ceil(reach * psf_mm / cell_mm_));
  const double scale = cell_mm_ / (psf_mm * std::numbers::sqrt2);
  std::vector<double> kernel;
  for (int k = -radius; k <= radius; ++k) {
    kernel.push_back((std::erf((k + 0.5) * scale) - std::erf((k - 0.5) * scale)) / 2.0);
  }

  std::vector<double> row(nx_);
  for (int j = 0; j < ny_; ++j) {
    std::fill(row.begin(), row.end(), 0.0);
    for (int k = -radius; k <= radius; ++k) {
      for (int i = std::max(0, -k); i < std::min(nx_, nx_ - k); ++i) {
        row[i] += kernel[k + radius] * cell(i + k, j);
      }
    }
    std::copy(row.begin(), row.end(), &cell(0, j));
  }

  std::vector<double> blurred(values_.size(), 0.0);
  for (int j = 0; j < ny_; ++j) {
    double* out = &blurred[static_cast<std::size_t>(j) * nx_];
    for (int k = std::max(-radius, -j); k <= std::min(radius, ny_ - 1 - j); ++k) {
      const double* in = &cell(0, j + k);
      for (int i = 0; i < nx_; ++i) {
        out[i] += kernel[k + radius] * in[i];
      }
    }
  }
  values_ = std::move(blurred);
}

double DisplacementField::mean(const Pose& T_object_element, double edge_mm) const {
  // Samples are as fine as the field; the cap bounds the time for an element much larger than the
  // shape.
  const int n = static_cast<int>(std::clamp(std::ceil(edge_mm / cell_mm_), 1.0, 256.0));
  const glm::dvec2 step_x = rotate(T_object_element.theta_rad, {edge_mm / n, 0.0});
  const glm::dvec2 step_y = rotate(T_object_element.theta_rad, {0.0, edge_mm / n});
  double sum = 0.0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      sum += interpolate(T_object_element.translation_mm + (i + 0.5 - n / 2.0) * step_x +
                         (j + 0.5 - n / 2.0) * step_y);
    }
  }
  return sum / (n * n);
}

/// Interpolates bilinearly between cell centres; 0 beyond the grid, whose border the shape does not
/// reach.
double DisplacementField::interpolate(const glm::dvec2& p_object_mm) const {
  const glm::dvec2 u = (p_object_mm - lower_mm_) / cell_mm_ - 0.5;
  if (!(u.x >= 0.0 && u.x < nx_ - 1 && u.y >= 0.0 && u.y < ny_ - 1)) {
    return 0.0;
  }
  const int i = static_cast<int>(u.x);
  const int j = static_cast<int>(u.y);
  return glm::mix(glm::mix(cell(i, j), cell(i + 1, j), u.x - i),
                  glm::mix(cell(i, j + 1), cell(i + 1, j + 1), u.x - i), u.y - j);
}

}  // namespace palpate
