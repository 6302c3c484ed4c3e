#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "learning/cross_validation.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Touches at known poses have a table of seven levels over the mean pressure, which also tells
/// where between the elements an edge lies. Presses at unknown poses have a table of contact over
/// log odds, and one of seven levels: pressures tell more, but change from day to day more than
/// contact does.
std::vector<TableKind> default_tables(bool known_poses);

/// A table that was tried: the cross-validation's log-loss with temperature and features, in nats.
struct TriedTable {
  TableKind kind;
  double log_loss = 0.0;
};

/// Scores of the touches, several of one object at a time.
struct GroupScores {
  std::size_t touches = 0;  ///< of a group
  Scores before;            ///< see SensorCalibration::before
  Scores table;
  Scores after;
};

/// A learned sensor and how good it is on presses that it has not seen.
struct SensorCalibration {
  LearnedSensor sensor;
  MapOptions maps;  ///< of the maps that presses were compared with
  /// Where the array sits in the tool, from touches at known poses of objects whose maps are drawn;
  /// all else is learned with the array there. None where it sits where the recordings say.
  std::optional<SetupFinding> array_offset = {};
  std::size_t objects = 0;
  std::vector<TriedTable> tried;  ///< in the options' order; none with one object
  /// Scores of the cross-validation; none with one object.
  std::optional<Scores> before;       ///< Eq. 7 with gamma 0.1, temperature 1
  std::optional<Scores> table;        ///< the table, temperature 1
  std::optional<Scores> after;        ///< the table, temperature and features
  std::optional<GroupScores> groups;  ///< none for presses at unknown poses, or few touches
  std::optional<SensorGain> gain;     ///< none for few touches at known poses, or one object
  std::vector<std::string> warnings;  ///< what could not be learned, in whole sentences
};

/// Learns from presses the contact threshold and ratio, the noise floor, gamma, the prior, the
/// table, the temperature and the fit of presses, of learned objects and of strangers.
///   Presses at known poses are counted, and recognised alone and in groups, as far from the
///   nearest bin as unknowns are. They also give by how much the temperature
///   grows with every further touch. Presses at unknown poses show much of an object. They also
///   give the features' distributions with their weight.
/// Among several tables it keeps the first, unless a later one has less log-loss in the
/// cross-validation by more than two standard errors. What one object cannot tell (temperature,
/// weight) keeps its default, with a warning. Takes all host threads.
///   The numbers before and after are of cross-validation. All that a fold's presses are judged by
/// is learned again from the presses of the other folds alone, from the contact threshold on:
/// noise, prior, levels, maps, tables and features. Which table is kept, temperature, and
/// weight come from the scores of the other folds' presses.
///
/// Data that say little:
///   one press: refused; so are presses none of which has a map of its object without it
///   a press all of whose elements are Unknown: left out, with a warning; refused where all are
///   a dead element: left out everywhere
///   a stuck element, the same high pressure in each touch: counts as In Contact, with a warning
///   presses whose other folds tell no threshold: not judged
///   levels that no reading reached, and nodes that no map had: what Eq. 7 says, see table_of();
///   levels of the same pressures are merged, see level_edges_of()
///   an object whose touches have no map without them: nothing but the threshold, noise, prior and
///   its features is learned from it, with a warning
///   two labels of the same object: the temperature grows until both are as likely; no warning
/// @param presses all at known poses or all at unknown ones
/// @param given maps to compare presses with, with their mean level where a table is over that;
/// without: maps of other presses
/// @throws Error where no press has a map of its object that it is no part of, where presses tell
/// no threshold or have no pressure above it, where some poses are known and some not, and as
/// observed_map() and learn_table() do; what `progress` throws
SensorCalibration calibrate_sensor(const std::vector<Press>& presses,
                                   const std::vector<OccupancyGrid>& given,
                                   const CalibrationSettings& options,
                                   const std::function<void(double)>& progress = {});

}  // namespace palpate
