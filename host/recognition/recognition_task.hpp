#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "palpate/balanced_lattice.hpp"
#include "palpate/device.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/filter.hpp"

namespace palpate {

/// The objects that an unknown may be, and the filter that tells which. The constructor derives the
/// labels and bodies; neither the hypotheses nor the filter's none_weight may change afterwards.
struct RecognitionTask {
  RecognitionTask(std::vector<Hypothesis> objects, const FilterOptions& options);

  /// The lattice of the histogram or of the bounded posterior, or the particles' region, whose bins
  /// only marginals have.
  const PoseLattice& lattice() const;
  PoseLattice& lattice();
  const ContactModel& contact() const;
  /// How far a touch may be displaced; only a histogram allows for it.
  DisplacementSd touch_sd() const;
  /// How far the object may move between two touches; only a histogram allows for it (the motion
  /// noise of particles is not meant).
  DisplacementSd slip_sd() const;
  /// Bins of all objects together.
  std::int64_t bins_in_all() const;
  const ContactClassifier& classifier() const { return contact().classifier; }

  std::vector<Hypothesis> hypotheses;
  FilterOptions filter;
  /// Each label once, in the order of the maps; none_label comes last where "none of these" has a
  /// weight.
  std::vector<std::string> labels;
  std::vector<std::size_t> label_of;  ///< [hypothesis] index into labels
  /// [hypothesis] the occupied cells of its map; none where no cell is.
  std::vector<std::optional<Body>> bodies;
  std::vector<std::string> map_paths = {};  ///< [hypothesis] file of the map; empty without files
  /// By which settle_bins() chooses the lattice's counts; none where these are given.
  std::optional<BinWidth> bin_width = {};
  /// settle_filter() chooses between the histogram and bounds.
  bool auto_filter = false;
  /// What asked for the filter, such as an option; "" where nothing did.
  std::string filter_asked_for_by = {};
  /// The pivot is the array's centre at the first touch of each unknown with an element In Contact.
  bool auto_pivot = false;
  /// Of labels' probabilities, see LearnedSensor; poses are left as they are.
  double temperature = 1.0;
  double temperature_growth = 0.0;
  std::optional<BinSteps> learned_bins = {};  ///< LearnedSensor::bins
  std::optional<LearnedFeatures> features = {};
  std::optional<Familiarity> familiarity = {};
  FitScale fit_scale = {};                  ///< of RecognitionStep::fit
  std::function<void()> cancel_point = {};  ///< BoundedOptions::cancel_point, where bounds search
  std::vector<std::string> remarks = {};    ///< sentences for the user, once the filter is open
};

/// What to say where the task's bins are more than 1.5 times as wide as those of the sensor model;
/// "" elsewhere. The bins are settled before.
std::string wider_bins_sentence(const RecognitionTask& task);

/// Whether a single touch tells how probably its object was learned: the task has a Familiarity,
/// and the filter a mode with the log-likelihood of the touch.
bool tells_known(const RecognitionTask& task);

/// Most bins, of all objects together, for which `auto` takes the histogram: up to here it answers
/// quickly, and takes no longer where nothing fits. Above it, bounds answer much sooner where
/// something does.
inline constexpr std::int64_t most_histogram_bins = 100'000;

/// Most bins, of all objects together, that settle_bins() gives to bounds.
inline constexpr std::int64_t most_bounded_bins = 1'000'000'000;

/// The options of a bounded posterior of the same bins; none where the histogram allows for
/// something that bounds do not: touch_sd, slip_sd, a limit of its memory, or none_weight with
/// gamma 0.
std::optional<BoundedOptions> bounded_instead(const HistogramOptions& histogram);

/// Bins that are wider than the maps resolve, to keep their number within a limit.
struct CoarsenedBins {
  double step_mm = 0.0;        ///< along x and y
  std::int64_t most_bins = 0;  ///< limit of all objects' bins together
};

/// Chooses the lattice's counts by balanced_lattice() if the task leaves them to it (bin_width). As
/// many as the device's memory holds, or most_bounded_bins where bounds are or may become the
/// filter.
/// @returns the bins if they had to be coarsened
/// @throws Error as balanced_lattice() does
std::optional<CoarsenedBins> settle_bins(const Device& device, RecognitionTask& task);

/// A temperature above 1 and features give also improbable labels a share, and familiarity asks how
/// far the best label leads, which needs their evidence: has bounds find each log evidence within
/// 0.05 times the temperature of the touches so far, so that no probability is off by more than
/// about 10 % or 1e-4, unless BoundedOptions::evidence_nats says how closely. The filter is settled
/// before.
void settle_evidence(RecognitionTask& task);

/// Chooses the filter if the task leaves it to this rule (auto_filter): of more than
/// most_histogram_bins bins in all, bounds take the place of the histogram, unless
/// bounded_instead() has none or bounds have no room. The counts are settled before.
/// @throws Error on a lattice out of range
void settle_filter(RecognitionTask& task);

/// Whether the machine has room for the task's bins by bounds, whatever its filter.
/// @throws Error on a lattice out of range
bool bounds_have_room(const RecognitionTask& task);

}  // namespace palpate
