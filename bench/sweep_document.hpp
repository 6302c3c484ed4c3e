#pragma once

#include <optional>
#include <string>
#include <vector>

#include "measurement.hpp"
#include "sweep_plan.hpp"
#include "table.hpp"
#include "trial_errors.hpp"

namespace palpate::bench {

// The records of the sweep's document.

/// How far log-likelihoods are from float64, in nats.
Json record_of(const ErrorStatistics& deviation);
/// Mean, standard error, median and 95th percentile, which is null for fewer than 20 trials; null
/// where no trial has an error.
Json record_of(const std::optional<ErrorsOverTrials>& errors);
/// Puts pose errors into the record of a run: those of each trial, and what they are over all.
void set_errors(Json& record, const PoseErrors& errors);
/// By how much the first run's mean error exceeds the second's, with its standard error.
Json difference_of(const PairedErrors& paired);

/// Where more bins stop helping on maps of one cell size, by the document's points: the fewest bins
/// that suffice (knee_of()), the error on the finest lattice, the lattice that --bins auto takes,
/// and what more bins gain from step to step.
Json knee_record(const Json& points, double cell_mm, const BinCounts& balanced);

/// From how many bins on the bounded posterior is faster than the histogram, by the records of
/// measure_bounds() in the order of their bins, beside the rule of --filter auto; null where one of
/// the two is faster on every lattice.
Json auto_rule_of(const Json& bounds);

/// How well windows agree with the full posterior over the document's points.
std::string window_sentence(const Json& points);

/// The error of a run's modes or of its refined poses, and what the poses cost.
struct PosedError {
  const Json& point;
  const char* pose;      ///< "mode" or "refined"
  const Json& error_mm;  ///< mean, median, ...
  double seconds;        ///< per unknown: an estimate after each touch, and one refined pose
};
/// All poses of the document's points, which they refer to.
std::vector<PosedError> posed_errors(const Json& points);

/// The Pareto fronts of time and error: of the poses, over runs that recognise and locate all
/// `trials`, as errors over some of the trials would flatter; and of the likelihood's evaluations.
Json fronts_of(const Json& points, const Json& precisions, int trials);
inline constexpr const char* pose_front = "seconds per unknown, mean error in mm";
inline constexpr const char* precision_front =
    "ns per pose, element and touch, largest deviation in nats";

}  // namespace palpate::bench
