#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// How well presses fit the map of one press each: rows are presses, columns the maps. 1: as well
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
