#include "estimation/bounded/search/displaced_tiles.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/bounded/search/largest_tiles.hpp"

namespace palpate {

namespace {

/// Penalties that float32 holds exactly; larger ones count as much, which leaves bounds true.
constexpr std::uint32_t exact_most = std::uint32_t{1} << 24;

}  // namespace

PlaceSource<float> exact_penalties(const SearchSpace& space, std::size_t object, std::size_t level,
                                   const KnownElements& touch) {
  return [&, object, level](std::span<const BlockRun> runs, const PlaceRows<float>& rows) {
    const TileBounds& bounds = space.bounds[object];
    const TileLevel& tiling = bounds.levels()[level];
    thread_local WindowPlaces placed;
    bounds.place(level, space.turns[static_cast<std::size_t>(runs.front().theta)], touch, placed);
    for (const BlockRun& run : runs) {
      const int y = batch_side * run.y;
      for (int x = batch_side * run.x; x < batch_side * (run.x + run.count); x += batch_side) {
        std::uint32_t sums[batch_tiles] = {};
        bounds.add(level, touch, placed, x, y, sums);
        for (int j = 0; j < batch_side && tiling.y.bins(y + j) > 0; ++j) {
          float* const row = rows.at(x, y + j);
          for (int i = 0; i < batch_side && tiling.x.bins(x + i) > 0; ++i) {
            row[i] = static_cast<float>(std::min(sums[batch_side * i + j], exact_most)) *
                     static_cast<float>(-1.0 / penalties_per_nat);
          }
        }
      }
    }
  };
}

std::vector<std::int32_t> displaced_penalties(const SearchSpace& space, std::size_t object,
                                              std::size_t level, const KnownElements& touch,
                                              std::span<const BlockRun> targets) {
  const std::vector<double> logs = space.displaced[level].bounds(
      touch.sensor_from_pivot_mm, targets, exact_penalties(space, object, level, touch));
  std::vector<std::int32_t> penalties(logs.size());
  for (std::size_t batch = 0; batch < logs.size(); batch += batch_tiles) {
    for (std::size_t i = 0; i < batch_side; ++i) {
      for (std::size_t j = 0; j < batch_side; ++j) {
        const double penalty = std::floor(-penalties_per_nat * logs[batch + batch_side * j + i]);
        penalties[batch + batch_side * i + j] =
            static_cast<std::int32_t>(std::min(penalty, static_cast<double>(largest_sum)));
      }
    }
  }
  return penalties;
}

std::vector<BoundingBox> displaced_reaches(const SearchSpace& space,
                                           std::span<const KnownElements> touches) {
  std::vector<BoundingBox> reaches(space.turns.size());
  const DisplacementWeights& weights = *space.displacement;
  const PoseLattice& lattice = weights.lattice();
  const glm::dvec2 step_mm(lattice.x_mm.count > 1 ? lattice.x_mm.step() : 0.0,
                           lattice.y_mm.count > 1 ? lattice.y_mm.step() : 0.0);
  for (const KnownElements& touch : touches) {
    const std::vector<BoundingBox> turned = reaches_of(touch, space.turns);
    for (std::size_t theta = 0; theta < reaches.size(); ++theta) {
      for (const Tap& tap : weights.taps(static_cast<int>(theta), touch.sensor_from_pivot_mm)) {
        const glm::dvec2 moved = glm::dvec2(tap.bins) * step_mm;
        reaches[theta].take_in(turned[tap.theta].lower + moved - weights.reach_mm());
        reaches[theta].take_in(turned[tap.theta].upper + moved + weights.reach_mm());
      }
    }
  }
  return reaches;
}

}  // namespace palpate
