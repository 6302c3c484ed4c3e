#include "estimation/lattice/flattening.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace palpate {

namespace {

// A larger share suits coarse bins after many touches, a smaller share fine bins after few.
constexpr double wanted_share = 1.0 / 3.0;
// To an n of 1e20. Where bins differ by more nats, one bin has all the weight whatever the n.
constexpr int most_doublings = 64;

/// Root mean square distance from the mean under weights exp(log-likelihood * inverse_root).
double spread_mm(std::span<const DisplacedBin> bins, double top, double inverse_root) {
  glm::dvec3 sum{0.0};
  double squares = 0.0;
  double total = 0.0;
  for (const DisplacedBin& bin : bins) {
    const double weight = std::exp((bin.log_likelihood - top) * inverse_root);
    sum += weight * bin.moved_mm;
    squares += weight * glm::dot(bin.moved_mm, bin.moved_mm);
    total += weight;
  }
  sum /= total;
  return std::sqrt(std::max(0.0, squares / total - glm::dot(sum, sum)));
}

}  // namespace

double flattening_root(std::span<const DisplacedBin> bins, double least) {
  const double top = std::ranges::max(bins, {}, &DisplacedBin::log_likelihood).log_likelihood;
  const double wanted_mm = wanted_share * spread_mm(bins, top, 0.0);
  double root = least;
  double narrow_mm = spread_mm(bins, top, 1.0 / root);
  for (int i = 0; i < most_doublings && narrow_mm < wanted_mm; ++i) {
    const double wide_mm = spread_mm(bins, top, 0.5 / root);
    if (wide_mm >= wanted_mm) {
      // Interpolated, so that the root follows the belief without steps.
      return root * std::exp2((wanted_mm - narrow_mm) / (wide_mm - narrow_mm));
    }
    root *= 2.0;
    narrow_mm = wide_mm;
  }
  return root;
}

}  // namespace palpate
