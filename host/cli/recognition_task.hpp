#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "command_files.hpp"
#include "options.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/scene.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags that say what is known and how it is recognised, as given.
struct RecognitionFlags {
  std::vector<std::string> maps;
  std::string scene;
  std::string bins;
  std::string x_mm;
  std::string y_mm;
  std::string theta_deg;
  std::string pivot_mm;
  std::optional<double> prior;
  std::optional<double> gamma;
  std::optional<double> none;
  std::optional<double> threshold;
  std::optional<double> ratio;
  std::optional<int> memory_mib;
  std::string filter;
  std::optional<int> particles;
  std::string resampling;
  bool augmented = false;
  std::optional<std::uint64_t> seed;
  std::string device;
};

void add_recognition_flags(CLI::App& command, RecognitionFlags& flags);

/// What the flags and the scene file together ask for; a flag overrides the scene's key.
struct RecognitionTask {
  std::vector<Hypothesis> hypotheses;
  std::vector<std::string> map_paths;  ///< [hypothesis]
  std::vector<std::string> labels;     ///< each once, in the order of the maps; last, if any, none
  std::vector<std::size_t> label_of;   ///< [hypothesis] index into labels
  HistogramOptions histogram;
  std::optional<ParticleOptions> particles;  ///< where the particle filter was asked for
  bool auto_bins = false;                    ///< the lattice's counts are still to be chosen
  std::string device;
};

/// The scene file that the flags name, or an empty scene. Throws Error.
Scene scene_of(const RecognitionFlags& flags);

/// Puts the scene's array, where it has one, in the place of the source's own. Throws Error where
/// it has not as many elements.
void replace_array(const Scene& scene, const std::string& scene_file, const std::string& source,
                   std::size_t elements, std::vector<glm::dvec2>& elements_mm);

/// Reads and checks everything that the flags name, for pressures of this unit. `source` is where
/// they come from, for messages. Throws Error.
RecognitionTask prepare(const RecognitionFlags& flags, const Scene& scene,
                        const std::string& pressure_unit, const std::string& source);

/// Adds the scene file and its array's, and the maps.
void add_recognition_files(const RecognitionFlags& flags, const Scene& scene,
                           const RecognitionTask& task, CommandFiles& files);

}  // namespace palpate::cli
