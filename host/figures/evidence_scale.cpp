#include "figures/evidence_scale.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace palpate {

namespace {

/// Smaller evidence is left by a Gaussian's tail and does not count.
constexpr double least_evidence_nats = 0.01;

/// Returns the next larger 1, 2, 4, 6 or 8 times a power of ten: its half has one digit, too.
double round_up(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 4.0, 6.0, 8.0}) {
    if (factor * decade >= value) {
      return factor * decade;
    }
  }
  return 10.0 * decade;
}

}  // namespace

EvidenceScale evidence_scale(std::span<const OccupancyGrid> maps) {
  std::vector<double> strengths;
  for (const OccupancyGrid& map : maps) {
    const double prior = map.prior_log_odds();
    for (const float log_odds : map.log_odds) {
      const double strength = std::abs(log_odds - prior);
      if (strength >= least_evidence_nats && std::isfinite(strength)) {
        strengths.push_back(strength);
      }
    }
  }
  if (strengths.empty()) {
    return {};
  }
  const auto ninth = strengths.begin() + static_cast<std::ptrdiff_t>(strengths.size() * 9 / 10);
  std::nth_element(strengths.begin(), ninth, strengths.end());
  return {round_up(*ninth)};
}

}  // namespace palpate
