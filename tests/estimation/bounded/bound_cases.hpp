#pragma once

#include <vector>

#include "bins_by_definition.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// One of the kinds of maps that bounds must hold on: a letter; noise of log odds within +-12 or
/// +-1000; few cells; cells of 0.02 and 100 mm; one cell.
OccupancyGrid random_bound_map(Uniform& random);

/// A random map, a model (Eq. 7 with gamma of 0 or 0.1, or a crooked table of two objects'
/// numbers), a lattice around the map (steps from a tenth of a cell to many cells, axes of one bin,
/// one theta) and elements on and off the map, some of them at places where bins meet the cells'
/// borders.
BinCase random_bound_case(Uniform& random);

/// The case's object, of the numbers in its table.
std::size_t random_object(const BinCase& of, Uniform& random);

/// Cosine and sine of a theta of the lattice.
glm::dvec2 turn_of(const PoseLattice& lattice, int theta);

/// Calls visit(first_x, first_y) with the first tile of every batch of a level.
template <typename Visit>
void for_batches(const TileLevel& level, const Visit& visit) {
  for (int y = 0; y < level.y.tiles(); y += batch_side) {
    for (int x = 0; x < level.x.tiles(); x += batch_side) {
      visit(x, y);
    }
  }
}

}  // namespace palpate
