#pragma once

#include <cstdint>
#include <vector>

#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// A table of random numbers for every object and four levels of contact between 6 and 20 kPa.
ContactModel random_table(std::size_t objects);

/// A learned sensor on maps that were sensed in part, over their log odds or mean levels: of three
/// objects, the second has numbers of its own and may lie on either side.
struct LearnedScene {
  std::vector<Hypothesis> objects;
  ContactModel contact;
};
LearnedScene learned_scene(MapLayer of, std::uint64_t seed);

}  // namespace palpate
