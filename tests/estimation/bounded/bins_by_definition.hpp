#pragma once

#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"

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

/// Log-likelihood of the elements at every bin of the boxes, in nats, from the reference. The pivot
/// is the robot's origin.
std::vector<double> by_definition(const BinCase& of, const std::vector<BinBox>& boxes);

}  // namespace palpate
