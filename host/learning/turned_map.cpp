#include "turned_map.hpp"

#include <cmath>

#include "interpolated_map.hpp"
#include "palpate/pose.hpp"

namespace palpate {

TurnedMap::TurnedMap(const OccupancyGrid& compared, const ReadingGains& gains, double step_mm,
                     double theta_rad, int reach) {
  // Beyond one cell around the grid every gain is 0.
  BoundingBox box;
  for (const int j : {-1, compared.ny}) {
    for (const int i : {-1, compared.nx}) {
      box.take_in(rotate(-theta_rad, compared.centre_mm(i, j)) / step_mm);
    }
  }
  const int left = static_cast<int>(std::ceil(box.lower.x));
  const int right = static_cast<int>(std::floor(box.upper.x));
  x_ = left - reach;
  nx_ = right - left + 1 + 2 * reach;
  y_ = static_cast<int>(std::ceil(box.lower.y));
  ny_ = static_cast<int>(std::floor(box.upper.y)) - y_ + 1;
  const auto width = static_cast<std::size_t>(nx_) + 1;
  const std::size_t plane = width * static_cast<std::size_t>(ny_);
  sums_.assign(gains.levels() * plane, 0.0F);
  const InterpolatedMap place(compared, compared.prior);
  const glm::dvec2 along = rotate(theta_rad, {step_mm, 0.0});
  const glm::dvec2 across = rotate(theta_rad, {0.0, step_mm});
  std::vector<std::size_t> nodes(static_cast<std::size_t>(nx_));
  for (int j = 0; j < ny_; ++j) {
    for (int i = 0; i < nx_; ++i) {
      nodes[static_cast<std::size_t>(i)] = ReadingGains::node_of(place.log_odds(
          static_cast<double>(x_ + i) * along + static_cast<double>(y_ + j) * across));
    }
    for (std::size_t level = 0; level < gains.levels(); ++level) {
      float* sums = sums_.data() + level * plane + static_cast<std::size_t>(j) * width;
      for (std::size_t i = 0; i + 1 < width; ++i) {
        sums[i + 1] = sums[i] + gains.at_node(level, nodes[i]);
      }
    }
  }
}

}  // namespace palpate
