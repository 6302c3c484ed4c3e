#include "figures/placed_belief.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "model/bounding_box.hpp"

namespace palpate {

namespace {

constexpr double divided = 1e-4;  ///< share of a bin that is drawn in parts
constexpr double shown = 1e-4;    ///< of the likeliest bin's share
constexpr int cells_across = 160;
constexpr double least_window_mm = 4.0;

/// Calls see(p_mm, share) with the origin of T_robot_object at the bin's centre, or of each of its
/// parts at theirs.
template <typename See>
void for_parts(const PoseLattice& lattice, const BinShare& bin, const See& see) {
  const std::int64_t row = bin.bin / lattice.x_mm.count;
  const auto place = [](const Axis& axis, std::int64_t i, int part) {
    return axis.centre(static_cast<int>(i)) + part * axis.step() / 3.0;
  };
  const int reach = bin.share < divided ? 0 : 1;
  for (int w = -reach; w <= reach; ++w) {
    for (int v = -reach; v <= reach; ++v) {
      for (int u = -reach; u <= reach; ++u) {
        const Pose T_object_robot =
            lattice.T_object_robot(place(lattice.x_mm, bin.bin % lattice.x_mm.count, u),
                                   place(lattice.y_mm, row % lattice.y_mm.count, v),
                                   place(lattice.theta_rad, row / lattice.y_mm.count, w));
        see(inverse(T_object_robot).translation_mm, reach == 0 ? bin.share : bin.share / 27.0);
      }
    }
  }
}

}  // namespace

PlacedBelief placed_belief(const PoseLattice& lattice, std::span<const BinShare> bins) {
  const double largest = std::ranges::max(bins, {}, &BinShare::share).share;
  BoundingBox box;
  for (const BinShare& bin : bins) {
    if (bin.share >= shown * largest) {
      for_parts(lattice, bin, [&box](const glm::dvec2& p_mm, double) { box.take_in(p_mm); });
    }
  }
  const double step = std::max({lattice.x_mm.step(), lattice.y_mm.step(), 1e-3});
  const double side = std::max({box.extent().x, box.extent().y, least_window_mm}) + 4.0 * step;
  PlacedBelief belief;
  belief.cell_mm = std::max(step, side / cells_across);
  belief.cells = static_cast<int>(std::ceil(side / belief.cell_mm));
  belief.lower_mm = box.middle() - glm::dvec2(0.5 * belief.cells * belief.cell_mm);
  belief.xy.assign(static_cast<std::size_t>(belief.cells) * belief.cells, 0.0);
  const auto add = [&belief](const glm::dvec2& p_mm, double share) {
    const glm::dvec2 cell = (p_mm - belief.lower_mm) / belief.cell_mm;
    const int i = static_cast<int>(std::floor(cell.x));
    const int j = static_cast<int>(std::floor(cell.y));
    if (i >= 0 && j >= 0 && i < belief.cells && j < belief.cells) {
      belief.xy[static_cast<std::size_t>(j) * belief.cells + i] += share;
    }
  };
  std::vector<double> turns(static_cast<std::size_t>(lattice.theta_rad.count), 0.0);
  for (const BinShare& bin : bins) {
    turns[static_cast<std::size_t>(bin.bin / lattice.plane())] += bin.share;
    for_parts(lattice, bin, add);
  }
  for (int k = 0; k < lattice.theta_rad.count; ++k) {
    double theta_rad = wrap_angle(-lattice.theta_rad.centre(k));
    belief.theta.push_back({theta_rad, turns[static_cast<std::size_t>(k)]});
  }
  std::ranges::sort(belief.theta, {}, &PlacedBelief::ThetaShare::theta_rad);
  return belief;
}

}  // namespace palpate
