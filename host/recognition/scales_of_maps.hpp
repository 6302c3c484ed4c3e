#pragma once

#include <optional>
#include <span>
#include <string>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// Whether no axis of the lattice has bins more than `wider` times as wide as the maps resolve.
/// @param near_mm reach of the arrays, where the pivot lies at a touch: an object then turns about
/// a place near it. Otherwise it may turn about any place of the region.
bool resolves(const PoseLattice& lattice, std::span<const Hypothesis> hypotheses, double wider,
              std::optional<double> near_mm);

/// Scales of what recognition says.
struct Scales {
  FitScale fit = {};    ///< LearnedSensor::fit_scale
  PoseScale pose = {};  ///< LearnedSensor::pose_scale
};
/// Those of the maps' own touches that were left out. That maps are off counts whatever judges.
/// @param near_mm see resolves()
Scales scales_of_maps(const RecognitionTask& task, std::optional<double> near_mm);

/// What is left out where the lattice would resolve the maps if the pivot lay at a touch, and does
/// not, and the remedy; else "".
/// @param without_none "(none)" is left out for its bins
std::string far_pivot_sentence(const RecognitionTask& task, double reach_mm, bool without_none);

}  // namespace palpate
