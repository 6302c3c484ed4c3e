#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// A touch, or several at poses that are known relative to each other, of an object. Views into
/// recordings that the caller keeps alive.
struct Press {
  std::string name;   ///< for messages, such as "pen.h5, touch 3"
  std::string label;  ///< of the object
  std::vector<Touch> touches;
  /// Where the robot knew the object's pose; maps that the press is compared with are in the object
  /// frame of its recording then.
  std::optional<Pose> T_object_robot = {};
  /// Whose press it is, such as a person's or a day's: presses of a group are alike in what those
  /// of another are not, and are left out together, of all objects. Empty: no group.
  std::string group = {};
};

/// What a recording was of, and whose it is.
struct GroupedObject {
  std::string label;
  std::string group;  ///< see Press::group
};
/// @param by "": no groups; "recording": each is a group of its own, named by its path; "label":
/// the group is what follows the last @ of the recording's object, "anna" of "cup@anna"
/// @throws Error on another word, and where `by` is "label" and the object has no @ amid its name
GroupedObject grouped_object(const Recording& recording, const std::string& by);

/// Whether the robot knew where it touched: some touches of the recording are at different poses.
bool has_poses(const Recording& recording);

/// The touches as one recording. Where their arrays differ, it has elements for the largest, and
/// those that a touch lacks are dead.
Recording gathered(const ObjectTouches& object, const std::string& pressure_unit);

/// One touch as a press: its pose is unknown, so the robot frame is put where the middle of the
/// array's elements is the origin and theta is 0.
Press single_press(const Recording& recording, std::size_t touch);

/// One touch at a known pose as a press; the recording's robot frame is the object's frame.
Press posed_press(const Recording& recording, std::size_t touch);

/// The fold of every press. At known poses press k of an object is in fold k % folds: a scan's
/// neighbours lie side by side, and a map without several in a row would have a hole. At unknown
/// poses press k of an object's n is in fold floor(k folds / n): presses made one after another are
/// more alike than those of another day. With groups, see Press::group, the presses of each are in
/// one fold, and an object's groups in as many folds as there are, about evenly.
std::vector<std::size_t> folds_of(const std::vector<Press>& presses, std::size_t folds);

/// The presses of all folds but one.
std::vector<Press> presses_without(std::size_t fold, const std::vector<Press>& presses,
                                   std::size_t folds);

/// Whether all presses are at known poses.
bool at_known_poses(const std::vector<Press>& presses);

/// A map that presses are compared with, and the presses that it was built from.
struct TrainingMap {
  OccupancyGrid map;
  std::vector<std::size_t> presses = {};  ///< indices, ascending; none of a map from elsewhere

  bool holds(std::size_t press) const { return std::ranges::binary_search(presses, press); }
};

/// The map that each press makes alone, see observed_map(), in the press's robot frame. Takes all
/// host threads.
/// @throws Error, naming the press, as observed_map() does
std::vector<TrainingMap> maps_of_presses(const std::vector<Press>& presses,
                                         const MapOptions& options);

/// Maps of presses at known poses, in the object frame.
struct MapsByFolds {
  std::vector<TrainingMap> of_objects;  ///< of all presses of every object
  /// For every object and every fold, see folds_of(), of the object's presses of the other folds.
  std::vector<TrainingMap> without_folds;
};
/// Takes all host threads.
/// @param presses at known poses, of one touch each
/// @throws Error, naming the object, as observed_map() does
MapsByFolds maps_by_folds(const std::vector<Press>& presses, const MapOptions& options,
                          std::size_t folds);

}  // namespace palpate
