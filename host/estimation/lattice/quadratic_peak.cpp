#include "estimation/lattice/quadratic_peak.hpp"

#include <cstddef>
#include <utility>
#include <vector>

namespace palpate {

namespace {

/// Solves matrix x = right in place, for a symmetric matrix, [n, n]. Returns false where the matrix
/// is not positive definite within rounding.
bool solve(std::vector<double> matrix, std::vector<double>& right) {
  constexpr double rounding = 1e-9;
  const std::size_t n = right.size();
  std::vector<double> least;
  for (std::size_t i = 0; i < n; ++i) {
    least.push_back(rounding * matrix[i * n + i]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double pivot = matrix[i * n + i];
    if (!(pivot > 0.0 && pivot > least[i])) {
      return false;
    }
    for (std::size_t row = i + 1; row < n; ++row) {
      const double factor = matrix[row * n + i] / pivot;
      for (std::size_t column = i; column < n; ++column) {
        matrix[row * n + column] -= factor * matrix[i * n + column];
      }
      right[row] -= factor * right[i];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t column = i + 1; column < n; ++column) {
      right[i] -= matrix[i * n + column] * right[column];
    }
    right[i] /= matrix[i * n + i];
  }
  return true;
}

}  // namespace

std::optional<glm::dvec3> quadratic_peak(std::span<const WeightedValue> values,
                                         const std::array<bool, 3>& varies,
                                         double least_curvature) {
  std::vector<int> axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (varies[axis]) {
      axes.push_back(axis);
    }
  }
  const std::size_t d = axes.size();
  const std::size_t unknowns = 1 + d + d * (d + 1) / 2;
  if (d == 0 || values.size() < 2 * unknowns) {
    return {};
  }
  // The normal equations in 1, the coordinates, and their products.
  std::vector<double> matrix(unknowns * unknowns);
  std::vector<double> fit(unknowns);
  std::vector<double> terms(unknowns);
  for (const WeightedValue& value : values) {
    std::size_t k = 0;
    terms[k++] = 1.0;
    for (const int axis : axes) {
      terms[k++] = value.at[axis];
    }
    for (std::size_t a = 0; a < d; ++a) {
      for (std::size_t b = a; b < d; ++b) {
        terms[k++] = value.at[axes[a]] * value.at[axes[b]];
      }
    }
    for (std::size_t row = 0; row < unknowns; ++row) {
      for (std::size_t column = 0; column < unknowns; ++column) {
        matrix[row * unknowns + column] += value.weight * terms[row] * terms[column];
      }
      fit[row] += value.weight * terms[row] * value.value;
    }
  }
  if (!solve(std::move(matrix), fit)) {
    return {};
  }
  // The slope vanishes where -(second derivatives) x = slope at 0.
  std::vector<double> curvature(d * d);
  std::vector<double> peak(fit.begin() + 1, fit.begin() + 1 + static_cast<std::ptrdiff_t>(d));
  std::size_t k = 1 + d;
  for (std::size_t a = 0; a < d; ++a) {
    for (std::size_t b = a; b < d; ++b, ++k) {
      curvature[a * d + b] -= fit[k];
      curvature[b * d + a] -= fit[k];
    }
    if (!(curvature[a * d + a] > least_curvature)) {
      return {};
    }
  }
  if (!solve(std::move(curvature), peak)) {
    return {};
  }
  glm::dvec3 at{0.0};
  for (std::size_t a = 0; a < d; ++a) {
    at[axes[a]] = peak[a];
  }
  return at;
}

}  // namespace palpate
