#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/contact_model.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// How presses at unknown poses become maps.
struct UnposedOptions {
  MapOptions map;                     ///< of the maps, and the classifier of their evidence
  ContactModel contact;               ///< by which presses are placed on maps, with its prior
  std::optional<ReadingLayer> layer;  ///< what the contact model's table is over
  std::size_t most_maps = 1;          ///< at least 1
  bool mirror = false;                ///< the object may lie on its other side
  /// By which log-likelihoods are divided to say how sure a place is: neighbouring elements are not
  /// independent, so that their sum exaggerates.
  double temperature = 10.0;
};

/// A press on the map that it became a part of.
struct PlacedPress {
  std::size_t press = 0;  ///< index into the presses
  Pose T_object_sensor;   ///< after the press is mirrored, x to -x, where it is
  bool mirrored = false;
  double weight = 1.0;  ///< in the map: how sure the place is, in (0, 1]
  /// Gain in log-likelihood over no map at all, on the map of the other presses, as a share of the
  /// gain on the map of this press alone; none where there are no others.
  std::optional<double> fit;
};

/// A map with its presses, in the order of their indices. The object frame's origin is the middle
/// of the contact of the press that the map began with, and its axes are the axes of that press.
struct UnposedMap {
  OccupancyGrid map;
  std::vector<PlacedPress> presses;
};

/// A press that is a part of no map.
struct Misfit {
  std::size_t press = 0;
  std::string reason;  ///< in words
};

struct UnposedMaps {
  std::vector<UnposedMap> maps;  ///< maps of more presses first
  std::vector<Misfit> misfits;
  int rounds = 0;       ///< in which every press was placed anew
  bool settled = true;  ///< the last round moved no press
};

/// Least fit (PlacedPress::fit) of a press that becomes part of a map.
inline constexpr double least_fit = 0.25;
/// Fit below which a press is given a map of its own where there may be more maps.
inline constexpr double good_fit = 0.7;
/// Fit below which a press on a map may well lie at a wrong place, or be of another object.
inline constexpr double doubtful_fit = 0.5;

/// Maps of one object from presses at unknown poses; the presses' own poses are ignored. Where
/// there are no more presses than maps, each press makes a map of its own: few presses recognise
/// better apart. Else each press is compared with the maps of single presses, which begin the maps
/// to which most presses fit; then each press in turn is taken out of its map, placed anew on the
/// map that it fits best and added there, with the weight of how sure its place is; it stays where
/// it was unless another place is clearly better. The rounds end when no press moves by more than a
/// quarter of the elements' spacing, after eight at most. The maps hold weighted means over their
/// presses: of log odds and of pressure.
/// @param progress is called now and then with the fraction done
/// @throws Error on a touch that is not sound, arrays of one element, or where no press can be
/// placed: none has an element In Contact
UnposedMaps unposed_maps(std::span<const Touch> presses, const std::string& label,
                         const UnposedOptions& options,
                         const std::function<void(double)>& progress = {});

/// The distance between neighbouring elements, in mm: the least over all presses.
/// @throws Error where no array has two elements apart
double element_pitch_mm(std::span<const Touch> presses);

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
