#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/scene.hpp"
#include "recognition/recognition_task.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags that say what a belief has to allow for: touches that lie elsewhere than reported,
/// objects that slip, and objects that were never learned. As given.
struct UncertaintyFlags {
  std::optional<double> touch_sd_mm;
  std::optional<double> touch_sd_deg;
  std::optional<double> slip_sd_mm;
  std::optional<double> slip_sd_deg;
  std::optional<std::string> none;  ///< a weight, or "auto"
};

void add_uncertainty_flags(CLI::App& command, UncertaintyFlags& flags);

// A flag overrides its scene key. Each function throws Error naming the flag, or the scene file and
// its key, whose value cannot be meant.

/// Sets touch_sd, slip_sd and none_weight. A standard deviation that is not given stays as it is.
void set_uncertainty(const UncertaintyFlags& flags, const Scene& scene,
                     std::span<const Hypothesis> hypotheses, HistogramOptions& histogram);
/// Sets the motion noise; what is not given keeps the paper's values. Refuses the flags and keys
/// that a particle filter has no use for.
void set_uncertainty(const UncertaintyFlags& flags, const Scene& scene,
                     const std::string& scene_file, ParticleOptions& particles);

/// The flag, or the key with its file, that gives a touch's pose a standard deviation above 0; ""
/// where nothing does.
std::string touch_sd_giver(const UncertaintyFlags& flags, const Scene& scene,
                           const std::string& scene_file);
/// The same of the object's slip between two touches.
std::string slip_sd_giver(const UncertaintyFlags& flags, const Scene& scene,
                          const std::string& scene_file);

/// Refuses standard deviations wider than the region. An axis of one bin limits nothing.
/// @param lattice with the counts that are used, or with one bin where these are not known yet
void require_within_region(const UncertaintyFlags& flags, const Scene& scene,
                           const std::string& scene_file, const PoseLattice& lattice);

/// What to say where the lattice does not resolve the task's touch_sd or slip_sd at one of these
/// poses of the sensor; else "".
/// @param lattice the task's, about the pivot in use
std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Pose> T_robot_sensor);
/// The same of these touches' poses.
std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Touch> touches);

}  // namespace palpate::cli
