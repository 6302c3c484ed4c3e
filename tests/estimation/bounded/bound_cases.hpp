#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/bounded/tables/window_table.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// A map, a model, a lattice and elements.
struct BinCase {
  OccupancyGrid map;
  ContactModel contact;
  PoseLattice lattice;
  KnownElements elements;
};

/// 36 elements of No Contact and In Contact over [-6, 6]^2 mm, on a map of 31 x 27 cells of 0.5 mm
/// with log odds within +-12; 65 x 31 x 3 bins of about 0.1 mm.
BinCase letter_case();

/// Elements of random readings below `levels`, spread evenly over a square about the pivot.
KnownElements random_elements(std::size_t count, double half_mm, std::size_t levels,
                              std::uint64_t seed);

/// A table of four levels that is not monotone, the last level steeper than any map.
LikelihoodTable crooked_table();
/// That of two objects: the second one's numbers are the first one's, backwards.
LikelihoodTable crooked_table_of_two();

/// Log-likelihood of the elements at every bin of the boxes, in nats, from the reference. The pivot
/// is the robot's origin.
std::vector<double> by_definition(const BinCase& of, const std::vector<BinBox>& boxes);

/// A random map, a model (Eq. 7 with gamma of 0 or 0.1, or a crooked table of two objects'
/// numbers), a lattice around the map (steps from a tenth of a cell to many cells, axes of one bin,
/// one theta) and elements on and off the map, some of them at places where bins meet the cells'
/// borders.
BinCase random_bound_case(Uniform& random);

/// The case's object, of the numbers in its table.
std::size_t random_object(const BinCase& of, Uniform& random);

/// Cosine and sine of a theta of the lattice.
glm::dvec2 turn_of(const PoseLattice& lattice, int theta);

/// Calls visit(level, tile, bound) for all tiles of all levels at a theta, in whole batches: the
/// bound of a bin's log-likelihood in nats.
template <typename Visit>
void for_tiles(const TileBounds& bounds, const BinCase& of, int theta, const Visit& visit) {
  WindowPlaces placed;
  for (std::size_t l = 0; l < bounds.levels().size(); ++l) {
    const TileLevel& level = bounds.levels()[l];
    bounds.place(l, turn_of(of.lattice, theta), of.elements, placed);
    const double best = bounds.best(l, of.elements);
    for (int y = 0; y < level.y.tiles(); y += batch_side) {
      for (int x = 0; x < level.x.tiles(); x += batch_side) {
        std::uint32_t sums[batch_tiles] = {};
        bounds.add(l, of.elements, placed, x, y, sums);
        for (int i = 0; i < batch_tiles; ++i) {
          const Tile tile{.theta = theta, .x = x + i / batch_side, .y = y + i % batch_side};
          visit(l, tile, best - sums[i] / penalties_per_nat);
        }
      }
    }
  }
}

/// The shape of an L, and a disc of twice its weight.
const std::vector<Hypothesis>& two_shapes();

/// Two maps of random cells, the second of three times the first one's weight.
const std::vector<Hypothesis>& two_made_up();

/// 13 x 12 x 16 bins.
BoundedOptions small_options();
/// These where touches are uncertain by 1 mm and 0.2 rad.
BoundedOptions uncertain_options();

/// Touches of the L, at one pose.
Recording touches_of_l(std::size_t touches, std::uint64_t seed);

/// Centres at whole cells, and quarter turns.
PoseLattice cell_by_cell(double cell_mm);
/// Touches whose elements lie exactly on the nodes of such cells, or on the borders between them,
/// at every bin of cell_by_cell().
Recording touches_on_nodes(double cell_mm);

/// The options of a histogram over the same bins, displacements and "none of these".
HistogramOptions dense_options(const BoundedOptions& options);

/// A posterior by bounds, and a histogram of the same bins.
struct BothFilters {
  BothFilters(const std::vector<Hypothesis>& objects, const BoundedOptions& options);
  void update(const Touch& touch);

  BoundedPosterior bounded;
  PoseHistogram dense;
};

}  // namespace palpate
