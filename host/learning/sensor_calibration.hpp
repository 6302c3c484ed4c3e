#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "learning/cross_validation.hpp"
#include "palpate/device.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"
#include "recognition/request.hpp"

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

/// Scores of models in the cross-validation.
struct ComparedScores {
  Scores before;  ///< Eq. 7 with gamma 0.1, temperature 1
  Scores table;   ///< the table, temperature 1
  Scores after;   ///< the table, temperature and features
};

/// A learned sensor and how good it is on presses that it has not seen.
struct SensorCalibration {
  LearnedSensor sensor;
  MapOptions maps;  ///< of the maps that presses were compared with
  /// Where the array sits in the tool, from touches at known poses of objects whose maps are drawn;
  /// all else is learned with the array there. None where it sits where the recordings say.
  std::optional<SetupFinding> array_offset = {};
  std::size_t objects = 0;
  std::vector<TriedTable> tried;          ///< in the options' order; none with one object
  std::optional<ComparedScores> touches;  ///< of single touches; none with one object
  /// Of presses_in_group touches of one object; none for presses at unknown poses, or few touches.
  std::optional<ComparedScores> groups;
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
///   presses whose other folds tell no threshold: not judged
///   levels that no reading reached, and nodes that no map had: what Eq. 7 says, see table_of();
///   levels of the same pressures are merged, see LearnedReadings::level_edges()
///   an object whose touches have no map without them: nothing but the threshold, noise, prior and
///   its features is learned from it, with a warning
///   two labels of the same object: the temperature grows until both are as likely; no warning
/// @param presses all at known poses or all at unknown ones
/// @param given maps to compare presses with, with their mean level where a table is over that;
/// without: maps of other presses
/// @throws Error where no press has a map of its object that it is no part of, where presses tell
/// no threshold or have no pressure above it, and as observed_map() and learn_table() do; what
/// `progress` throws
SensorCalibration calibrate_sensor(const std::vector<Press>& presses,
                                   const std::vector<OccupancyGrid>& given,
                                   const CalibrationSettings& options,
                                   const std::function<void(double)>& progress = {});

/// Says, without a full stop, that touches did not tell how badly strangers fit; "" where they did,
/// or where nothing of fits was learned.
std::string unlearned_strangers(const LearnedSensor& sensor);

/// What is asked of a calibration beside a Request's classifier, bins, region and frames, as a user
/// says it.
struct CalibrationRequest {
  bool unposed = false;        ///< the recordings' poses do not count
  std::string layer = "auto";  ///< auto, mean_level or log_odds
  std::optional<int> levels;   ///< of readings; none: as default_tables() has them
  int max_maps = 5;            ///< CalibrationSettings::most_maps
  std::string group;           ///< what is left out together, see grouped_object()
};

/// What calibrate_sensor() takes. Presses are views into the recordings.
struct CalibrationTask {
  std::vector<Press> presses;
  std::vector<OccupancyGrid> maps;
  CalibrationSettings options;

  bool known_poses() const { return presses.front().T_object_robot.has_value(); }
};

/// Makes the task: where all touches of each recording are at one pose, poses count as unknown.
/// With the layer auto, touches at known poses are compared by the mean pressure, on drawn maps by
/// log odds; at unknown ones both layers are tried, but without a mean level of every map only log
/// odds. On given maps, touches at known poses lie where the recording's truth says, or else where
/// the object was learned.
/// @param recognition what recognize will be given; its classifier, which is learned where it is
/// left out, bins, region and frames alone count
/// @param recordings of touches of one pressure unit, at least one
/// @param maps to compare touches with
/// @throws Error naming the option or the recording, where a value is out of range, a recording
/// names no object, some recordings alone have poses, bins are given for unknown poses, or a map
/// lacks the mean level that it needs
CalibrationTask calibration_task(const CalibrationRequest& request, const Request& recognition,
                                 std::span<const Recording> recordings,
                                 std::span<const GivenMap> maps);

}  // namespace palpate
