#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "options.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/scene.hpp"
#include "palpate/touch.hpp"

namespace palpate::cli {

/// The flags of `recognize`, as given.
struct RecognizeOptions {
  std::vector<std::string> recordings;
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
  std::string frames;
  std::optional<int> touches;
  bool each_frame = false;
  std::optional<int> memory_mib;
  std::string filter;
  std::optional<int> particles;
  std::string resampling;
  bool augmented = false;
  std::optional<std::uint64_t> seed;
  bool trace = false;
  std::string json;
  std::string posterior;
  std::string png;
  std::string device;
};

/// One unknown object: some touches of one recording, in order.
struct Unknown {
  const Recording* recording = nullptr;
  std::optional<std::size_t> frame;  ///< index in the file, with --each-frame
  std::vector<Touch> touches;
};

/// The label of "none of these", an object that was never learned.
inline constexpr const char* none_label = "(none)";

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
  std::vector<Recording> recordings;
  std::vector<Unknown> unknowns;
};

/// Reads and checks everything that the flags name. Throws Error.
RecognitionTask prepare(const RecognizeOptions& options);

}  // namespace palpate::cli
