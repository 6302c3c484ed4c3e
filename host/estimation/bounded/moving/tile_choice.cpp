#include "estimation/bounded/moving/tile_choice.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <tuple>

namespace palpate {

namespace {

/// Tiles that each object keeps, whatever the other objects' are worth.
constexpr std::size_t few_of_object = 16;

struct Ranked {
  bool known = false;
  double nats = 0.0;  ///< of what is known, or the bound, with the scale
  std::size_t object = 0;
  std::size_t tile = 0;

  auto rank() const { return std::tuple(known, nats); }
};

void follow_best(std::vector<Ranked>& tiles, std::size_t count, FollowedTiles& followed) {
  count = std::min(count, tiles.size());
  std::ranges::nth_element(tiles, tiles.begin() + static_cast<std::ptrdiff_t>(count),
                           std::greater<>(), &Ranked::rank);
  for (const Ranked& tile : std::span(tiles).first(count)) {
    followed[tile.object][tile.tile] = 1;
  }
}

}  // namespace

FollowedTiles all_that_matter(std::span<const TileBeliefs> objects) {
  FollowedTiles followed;
  for (const TileBeliefs& object : objects) {
    std::vector<std::uint8_t>& tiles = followed.emplace_back();
    for (const double bound : object.bound) {
      tiles.push_back(!(bound < object.least) ? 1 : 0);  // what is no number is followed
    }
  }
  return followed;
}

bool leave_best(std::size_t most, std::span<const TileBeliefs> objects, double depth,
                FollowedTiles& followed) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double most_known = -infinity;
  std::size_t wanted = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    most_known =
        std::max(most_known, objects[i].scale + *std::ranges::max_element(objects[i].known));
    wanted += static_cast<std::size_t>(std::ranges::count(followed[i], 1));
  }
  if (wanted <= most) {
    return false;
  }
  std::vector<Ranked> all;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const TileBeliefs& object = objects[i];
    std::vector<Ranked> of_object;
    for (std::size_t tile = 0; tile < object.bound.size(); ++tile) {
      if (followed[i][tile] == 1) {
        const double mass = object.scale + object.known[tile];
        const bool known = mass >= most_known - depth;
        const double nats = known ? mass : object.scale + object.bound[tile];
        const Ranked ranked{known, std::isnan(nats) ? infinity : nats, i, tile};
        all.push_back(ranked);
        of_object.push_back({true, object.held[tile], i, tile});
      }
    }
    std::ranges::fill(followed[i], std::uint8_t{0});
    follow_best(of_object, few_of_object, followed);
  }
  follow_best(all, most, followed);
  return true;
}

}  // namespace palpate
