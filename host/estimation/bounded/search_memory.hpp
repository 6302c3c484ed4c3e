#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Host memory in bytes that a search by bounds takes. In float64, as absurd lattices exceed every
/// integer.
struct SearchMemory {
  double tables = 0.0;  ///< of the maps: penalties of windows, nodes
  double tiles = 0.0;   ///< of every theta: the largest tiles, their sums and places in a search
  double bins = 0.0;    ///< that are evaluated together, with what displaced touches keep of theirs

  double largest_family = 0.0;  ///< bins that the smallest tiles of one larger tile hold
  double total() const { return tables + tiles + bins; }
};

/// The bins of all objects. In float64, as the product of three axes' counts may exceed an integer.
double bins_in_all(std::size_t objects, const PoseLattice& lattice);

/// Allocates nothing. What the search takes while it divides tiles is not foreseen.
/// @param options checked, with a resolved contact model
SearchMemory search_memory(std::span<const Hypothesis> hypotheses, const BoundedOptions& options);

/// Why a search cannot take the bins, and what to change: they are too many to number or to be
/// evaluated together, or it takes more memory than the limit. "" where it can.
/// @param options with a sound lattice
std::string why_no_room(std::span<const Hypothesis> hypotheses, const BoundedOptions& options,
                        std::uint64_t limit_bytes);

/// A quarter of the machine's memory: the rest is for its other programs, and for what the search
/// takes while it divides tiles.
std::uint64_t memory_for_search();

}  // namespace palpate
