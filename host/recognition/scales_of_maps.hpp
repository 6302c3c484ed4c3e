#pragma once

#include <span>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// Whether no axis of the lattice has bins more than `wider` times as wide as the maps resolve.
bool resolves(const PoseLattice& lattice, std::span<const Hypothesis> hypotheses, double wider);

/// Scales of what recognition says.
struct Scales {
  FitScale fit = {};    ///< RecognitionTask::fit_scale
  PoseScale pose = {};  ///< RecognitionTask::pose_scale
};
/// Those of the maps' own touches that were left out. That maps are off counts whatever judges.
Scales scales_of_maps(const RecognitionTask& task);

}  // namespace palpate
