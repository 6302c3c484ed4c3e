#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/touch_evidence.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/filter.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// How many have an element In Contact.
std::size_t touches_in_contact(std::span<const TouchEvidence> touches);

/// When a robot acts on a result; see decide().
struct ActWhere {
  double below_mm = 0.5;  ///< 95 % of the belief lies within this distance of the pose
  double above = 0.99;    ///< the best object's probability
};

/// The objects that an unknown may be, and the filter that tells which. Who makes a task settles
/// all of it; who recognises by it leaves it as it is.
struct RecognitionTask {
  RecognitionTask(std::vector<Hypothesis> objects, FilterOptions options);

  /// See lattice_of().
  const PoseLattice& lattice() const { return lattice_of(filter); }
  const ContactModel& contact() const { return contact_of(filter); }
  /// See FilterTraits.
  DisplacementSd touch_sd() const { return traits_of(filter).touch_sd; }
  DisplacementSd slip_sd() const { return traits_of(filter).slip_sd; }
  const ContactClassifier& classifier() const { return contact().classifier; }
  /// The label of a hypothesis, and that it is the mirrored one where it is.
  std::string name_of(int object) const;
  /// The temperature of those of the touches that tell something; before any, of one.
  double temperature_after(std::span<const TouchEvidence> touches) const;

  /// Of RecognitionStep::fit; 1 where the sensor has none.
  FitScale fit_scale() const { return sensor.fit_scale.value_or(FitScale{}); }
  /// Of RecognitionStep::refined and of modes; 1 where the sensor has none.
  PoseScale pose_scale() const { return sensor.pose_scale.value_or(PoseScale{}); }
  /// fit_scale() for the array of these touches, by the elements In Contact's touches that are
  /// known.
  FitScale fit_scale_for(std::span<const TouchEvidence> touches) const;
  /// Whether the filter computes on a device. Bounds search on the host.
  bool uses_device() const { return !traits_of(filter).certificate; }

  const std::vector<Hypothesis> hypotheses;
  const FilterOptions filter;  ///< as it is opened
  /// Each label once, in the order of the maps; none_label comes last where "none of these" has a
  /// weight.
  const std::vector<std::string> labels;
  const std::vector<std::size_t> label_of;  ///< [hypothesis] index into labels
  /// [hypothesis] the occupied cells of its map; none where no cell is.
  const std::vector<std::optional<Body>> bodies;
  std::vector<std::string> map_paths = {};  ///< [hypothesis] file of the map; empty without files
  /// What chose the filter, such as "`filter auto`" or "`posterior`"; "" where objects slip, which
  /// the histogram alone follows.
  std::string filter_chosen_by = {};
  /// The pivot is the array's centre at the first touch of each unknown with an element In Contact.
  bool auto_pivot = false;
  /// Touches of one place count as about one, see TouchPlaces.
  bool by_place = false;
  /// What was learned about the sensor: how sure probabilities are, the bins that they are for,
  /// press features and the scales of fits and poses. By Eq. 7 it has no file, and the scales
  /// alone, of the maps' left-out touches. What the request overrides, and its table, count as
  /// `filter` has them.
  SensorFromFile sensor = {};
  /// Tolerance of a trace's steps before the last; BoundedOptions::tolerance where it is not set.
  std::optional<double> trace_tolerance = {};
  /// The same of steps of which a picture shows the identity alone.
  std::optional<double> drawn_tolerance = {};
  ActWhere act = {};                      ///< for RecognitionStep::decision
  std::vector<std::string> remarks = {};  ///< sentences for the user, once the filter is open
};

}  // namespace palpate
