#pragma once

#include <filesystem>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Inputs of a small recognition and what the float64 reference makes of them, so that product and
/// reference cannot drift together unseen.
struct GoldenValues {
  struct Object {
    Recording training;            ///< in the object frame
    OccupancyGrid map;             ///< geometry, label and symmetry, and the log odds in float32
    std::vector<double> log_odds;  ///< [ny, nx], expected
  };
  /// Expected after a touch.
  struct Step {
    std::vector<double> identity;     ///< [object]
    double max_log_likelihood = 0.0;  ///< of the mode, in nats
  };
  struct Unknown {
    Recording touches;                                ///< with its truth
    std::vector<Step> trace;                          ///< [touch]
    std::vector<std::vector<double>> log_likelihood;  ///< [object][bin] after all touches
    double error_mm = 0.0;                            ///< pose error of the final mode
  };

  MapOptions map_options;
  HistogramOptions histogram_options;
  std::vector<Object> objects;
  std::vector<Unknown> unknowns;
};

/// As many digits as the file keeps: 10.
double rounded(double value);

/// Fills in everything that is expected, from the reference.
void compute_expected(GoldenValues& golden);

/// The objects' maps as hypotheses.
std::vector<Hypothesis> hypotheses(const GoldenValues& golden);

GoldenValues read_golden(const std::filesystem::path& path);
void write_golden(const std::filesystem::path& path, const GoldenValues& golden);

}  // namespace palpate
