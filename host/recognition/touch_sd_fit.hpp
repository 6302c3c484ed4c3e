#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "palpate/displacement.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// An object and the touches that it was touched with, views into memory that the caller keeps
/// alive.
struct TouchedObject {
  std::string name;  ///< of its recording, for messages
  std::vector<Touch> touches;
  std::string label = {};  ///< of the object where it is known and has a map; "" otherwise
};

/// The unknowns as the fit takes them: a recording that names an object of the task has its label.
/// @param recordings of which each is one of the unknowns
std::vector<TouchedObject> touched_objects(std::span<const Recording> recordings,
                                           std::span<const Unknown> unknowns,
                                           const RecognitionTask& task);

/// Throws Error where the task has particles, a touch_sd, a slip_sd, a sensor model's table or
/// "none of these", or the request options that the fit has no use for.
/// @param request that the task was resolved from
void require_fittable(const Request& request, const RecognitionTask& task);

struct TouchSdFitOptions {
  /// Where the search begins: with displacements so large that every pose which may explain the
  /// touches is among the samples.
  DisplacementSd start{2.0, 0.1};
  std::size_t samples = 64;  ///< of every unknown's object, pose and displacements
  int sweeps = 20;           ///< moves of every sample in every step of the search
  FilterResources resources = {};
  std::uint64_t seed = 0;
};

/// Standard deviations of the touches' poses about the poses that the robot reported.
struct TouchSdFit {
  DisplacementSd sd;  ///< 0: not distinguishable from 0, given the maps
  /// One standard error, from the scatter of the unknowns' scores about 0, the evidence's curvature
  /// and what a wrong width of the touches' likelihoods does; 0 where sd is 0.
  DisplacementSd standard_error;
  /// Below about this, sd cannot be told from 0: it moves the outermost elements by less than 0.3
  /// of a map's cell.
  DisplacementSd resolution;
  /// By how much the log evidence at sd exceeds the log evidence of exact poses, in nats.
  double evidence_gain = 0.0;
  std::size_t unknowns = 0;
  std::size_t touches = 0;
  std::vector<std::string> warnings;  ///< why the result may be far off, in whole sentences
};

/// Finds the standard deviations under which all the recordings' touches have the largest evidence,
/// and with them how often an element reads No Contact, In Contact or Unknown where the map is
/// occupied to a given degree (see ReadingModel and SmoothOccupancy).
///
/// Recognises every unknown with TouchSdFitOptions::start on the task's lattice (of which bin_width
/// chooses a coarse one), draws samples, and follows them through a sequence of standard deviations
/// by importance weights and Metropolis moves (Del Moral, Doucet and Jasra 2006). The steps are
/// Newton's on the log evidence, whose first and second derivatives are expectations over the
/// samples (Louis 1982). The same input gives the same result.
/// @param device may be null where uses_device() is false
/// @param task with a filter in bins; its touch_sd, slip_sd and none_weight are not used
/// @param progress called now and then with the fraction done
/// @throws Error on a particle filter, no unknowns, an unknown without touches, a touch that is not
/// sound, or if the device fails; what `progress` throws
TouchSdFit fit_touch_sd(Device* device, const RecognitionTask& task,
                        std::span<const TouchedObject> unknowns,
                        const TouchSdFitOptions& options = {},
                        const std::function<void(double)>& progress = {});

}  // namespace palpate
