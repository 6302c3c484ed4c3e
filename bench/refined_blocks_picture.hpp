#pragma once

#include <string>
#include <vector>

#include "palpate/bounded_posterior.hpp"

namespace palpate::bench {

/// A stage of a search for one unknown.
struct SearchPanel {
  std::string title;
  std::string caption;
  std::vector<PoseBlock> blocks;  ///< that were divided or, on the last level, evaluated
};

/// Draws the blocks of one object's poses that a search went into, stage by stage, over the
/// object's map. x and y are where the pivot lies on the object. A block is drawn where the search
/// went into it at any theta, in the colour of its level, and the fuller the more thetas.
/// `place_mm` is where the pivot truly lies. Returns the bytes of a PNG file.
/// @throws Error if Cairo fails
std::string draw_search(const std::vector<SearchPanel>& panels, int object,
                        const OccupancyGrid& map, const PoseLattice& lattice,
                        const glm::dvec2& place_mm);

/// Draws the search for one unknown letter after 1, 3 and 9 touches, over bins about the place of
/// the first touch: x and y are where it lies on the letter.
/// @throws Error if Cairo fails
std::string draw_refined_blocks(const std::vector<Hypothesis>& letters,
                                const PoseLattice& bins_about_touch);

}  // namespace palpate::bench
