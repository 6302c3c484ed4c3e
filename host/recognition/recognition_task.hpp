#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "palpate/balanced_lattice.hpp"
#include "palpate/device.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// The filter that recognises, by its options.
using FilterOptions = std::variant<HistogramOptions, ParticleOptions>;

/// The objects that an unknown may be, and the filter that tells which. The constructor derives the
/// labels; neither the hypotheses nor the histogram's none_weight may change afterwards.
struct RecognitionTask {
  RecognitionTask(std::vector<Hypothesis> objects, const FilterOptions& options);

  /// The histogram's lattice, or the particles' region, whose bins only marginals have.
  const PoseLattice& lattice() const;
  const ContactModel& contact() const;
  /// How far a touch may be displaced; none for particles.
  DisplacementSd touch_sd() const;
  const ContactClassifier& classifier() const { return contact().classifier; }

  std::vector<Hypothesis> hypotheses;
  FilterOptions filter;
  /// Each label once, in the order of the maps; none_label comes last where "none of these" has a
  /// weight.
  std::vector<std::string> labels;
  std::vector<std::size_t> label_of;        ///< [hypothesis] index into labels
  std::vector<std::string> map_paths = {};  ///< [hypothesis] file of the map; empty without files
  /// By which settle_bins() chooses the lattice's counts; none where the counts are given.
  std::optional<BinWidth> bin_width = {};
  /// The pivot is the array's centre at the first touch of each unknown with an element In Contact.
  bool auto_pivot = false;
};

/// Bins that are wider than the maps resolve, since the device has no memory for more.
struct CoarsenedBins {
  double step_mm = 0.0;        ///< along x and y
  std::int64_t most_bins = 0;  ///< limit of all objects' bins together
};

/// Chooses the lattice's counts by balanced_lattice() if the task leaves them to it (bin_width).
/// @returns the bins if they had to be coarsened
/// @throws Error as balanced_lattice() does
std::optional<CoarsenedBins> settle_bins(const Device& device, RecognitionTask& task);

}  // namespace palpate
