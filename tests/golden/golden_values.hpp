#pragma once

#include <filesystem>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The inputs of a small recognition, and the results that the float64 reference gave for them when
/// the file was written: a change of the product or of the reference shows.
struct GoldenValues {
  struct Object {
    Recording training;            ///< in the object frame
    OccupancyGrid map;             ///< geometry, label and symmetry, and the log odds in float32
    std::vector<double> log_odds;  ///< [ny, nx] expected
  };
  /// The results expected after a touch.
  struct Step {
    std::vector<double> identity;     ///< [object]
    double max_log_likelihood = 0.0;  ///< log-likelihood of the mode, in nats
  };
  struct Unknown {
    Recording touches;                                ///< with the true object and pose
    std::vector<Step> trace;                          ///< [touch]
    std::vector<std::vector<double>> log_likelihood;  ///< [object][bin] after all touches
    double error_mm = 0.0;                            ///< pose error of the final mode
  };

  MapOptions map_options;
  HistogramOptions histogram_options;
  std::vector<Object> objects;
  std::vector<Unknown> unknowns;
};

/// Rounds to the 10 digits that the file keeps.
double rounded(double value);

/// Fills in all expected results, from the reference.
void compute_expected(GoldenValues& golden);

/// The objects' maps as hypotheses.
std::vector<Hypothesis> hypotheses(const GoldenValues& golden);

GoldenValues read_golden(const std::filesystem::path& path);
void write_golden(const std::filesystem::path& path, const GoldenValues& golden);

}  // namespace palpate
