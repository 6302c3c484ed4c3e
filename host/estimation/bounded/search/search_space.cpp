#include "estimation/bounded/search/search_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "estimation/hypotheses.hpp"
#include "estimation/parallel_for.hpp"

namespace palpate {

std::vector<TileSize> tile_sizes(std::span<const Hypothesis> hypotheses,
                                 const BoundedOptions& options) {
  double least_cell_mm = std::numeric_limits<double>::infinity();
  for (const Hypothesis& hypothesis : hypotheses) {
    least_cell_mm = std::min(least_cell_mm, hypothesis.compared().cell_mm);
  }
  return tile_sizes(options.lattice, least_cell_mm, hypotheses.size(), options.touch_sd);
}

SearchSpace::SearchSpace(std::span<const Hypothesis> hypotheses, const BoundedOptions& options)
    : log_weight(log_weights(hypotheses)) {
  for (int theta = 0; theta < options.lattice.theta_rad.count; ++theta) {
    const double theta_rad = options.lattice.theta_rad.centre(theta);
    turns.emplace_back(std::cos(theta_rad), std::sin(theta_rad));
  }
  std::map<std::string, std::size_t> labels;
  for (const Hypothesis& hypothesis : hypotheses) {
    label_of.push_back(labels.try_emplace(hypothesis.map.label, labels.size()).first->second);
    boxes.push_back(occupied_box(hypothesis.map));
    OccupancyGrid shape = hypothesis.compared();
    shape.log_odds = {};
    maps.push_back(std::move(shape));
  }
  const std::vector<TileSize> sizes = tile_sizes(hypotheses, options);
  if (!options.touch_sd.none()) {
    displacement.emplace(options.lattice, options.touch_sd);
    for (const TileSize& size : sizes) {
      displaced.emplace_back(*displacement, size.bins);
    }
  }
  std::vector<std::optional<TileBounds>> built(hypotheses.size());
  parallel_for(hypotheses.size(), [&](std::size_t i) {
    built[i].emplace(hypotheses[i].compared(), options.contact, i, options.lattice, sizes);
  });
  for (std::optional<TileBounds>& of : built) {
    bounds.push_back(*std::move(of));
  }
}

std::uint64_t SearchSpace::bytes() const {
  std::uint64_t bytes = 0;
  for (const TileBounds& of : bounds) {
    bytes += of.bytes();
  }
  return bytes;
}

std::vector<std::vector<double>> unpenalised(const SearchSpace& space,
                                             const KnownElements& elements) {
  std::vector<std::vector<double>> logs;
  for (std::size_t i = 0; i < space.bounds.size(); ++i) {
    std::vector<double>& of_level = logs.emplace_back();
    for (std::size_t level = 0; level < space.bounds[i].levels().size(); ++level) {
      of_level.push_back(space.log_weight[i] + space.bounds[i].best(level, elements));
    }
  }
  return logs;
}

}  // namespace palpate
