#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "learning/fused_map.hpp"
#include "learning/press_search.hpp"
#include "learning/unposed_maps.hpp"

namespace palpate {

/// A press with all that does not depend on where it lies.
struct UnposedPress {
  std::size_t index = 0;         ///< into the presses given
  std::vector<PressSide> sides;  ///< as it is and, where asked for, mirrored
  PressImage image;              ///< in the robot frame of the first side
};

/// The map that a press is a part of, and its place there.
struct PressHome {
  std::optional<std::size_t> map;
  PressPlace place;  ///< on the map, or else on the one that it fits best
  double fit = 0.0;  ///< see PlacedPress::fit; 1 where the map is of this press alone
  /// Its contact gains so little, even on the map of this press alone, that the best of all the
  /// places compared may gain as much by chance. Set once all presses are placed.
  bool says_little = false;

  ImagePlace image_place() const;
};

/// Presses on maps.
struct FusedPresses {
  std::vector<PressHome> homes;  ///< [press]
  std::size_t maps = 0;          ///< some may be of no press
  int rounds = 0;                ///< in which every press was placed anew
  bool settled = true;           ///< the last round moved no press
};

/// Assigns presses to maps and places them, as unposed_maps() says. Takes all host threads.
/// @param step_mm of the lattices on which presses are placed
FusedPresses fuse_presses(std::span<const UnposedPress> presses, const UnposedOptions& options,
                          double step_mm, const std::function<void(double)>& progress);

/// How well presses fit maps of one press each: rows are presses, columns the maps. 1: as well
/// as in the press's own map.
struct FitTable {
  std::vector<std::size_t> columns;      ///< the press that each map is of
  std::vector<std::vector<double>> fit;  ///< [press][column]
};

/// The column that as a further map would raise the presses' best fits most, added up; a fit counts
/// from 0 to 1. Columns of presses that fit a map already are left out.
/// @param best [press] fit in the maps that there are, 0 without
/// @param enough fit from which a press needs no further map
/// @returns none where all presses fit
std::optional<std::size_t> next_map(const FitTable& table, std::span<const double> best,
                                    double enough);

}  // namespace palpate
