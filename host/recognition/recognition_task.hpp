#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "palpate/device.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate {

/// The filter that recognises, by its options.
using FilterOptions = std::variant<HistogramOptions, ParticleOptions>;

/// What unknowns are recognised among, and how. The constructor derives labels and bodies from the
/// hypotheses; the filter's none_weight stays as it is from then on.
struct RecognitionTask {
  RecognitionTask(std::vector<Hypothesis> objects, FilterOptions options);

  /// The histogram's lattice, or the region of the particles, whose bins count for pictures alone.
  const PoseLattice& lattice() const;
  const ContactClassifier& classifier() const;

  std::vector<Hypothesis> hypotheses;
  FilterOptions filter;
  /// Each label once, in the order of the maps; none_label comes last where "none of these" has a
  /// weight.
  std::vector<std::string> labels;
  std::vector<std::size_t> label_of;        ///< [hypothesis] index into labels
  std::vector<std::optional<Body>> bodies;  ///< [hypothesis] none where no cell is occupied
  std::vector<std::string> map_paths = {};  ///< [hypothesis] or empty: the files of the maps
  bool auto_bins = false;                   ///< settle_bins() has yet to count the lattice's bins
};

/// Bins wider than the maps are worth.
struct CoarsenedBins {
  double step_mm = 0.0;        ///< along x and y
  std::int64_t most_bins = 0;  ///< of all objects together, that the device holds
};

/// Counts the lattice's bins where they are left to the maps and the device, by balanced_lattice().
/// @returns the coarser bins that the device's memory made necessary, if any
/// @throws Error as balanced_lattice() does
std::optional<CoarsenedBins> settle_bins(const Device& device, RecognitionTask& task);

}  // namespace palpate
