#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "palpate/files.hpp"

namespace palpate {

// Summaries of files. Each function reads the whole file in pieces, holds a few MB of it, and
// throws Error as the file's reader does.

/// The smallest and the largest of some numbers.
struct Extremes {
  double least;
  double most;
};

struct RecordingSummary {
  Recording head;  ///< the recording without its rows
  std::uint64_t rows = 0;
  std::uint64_t elements = 0;
  bool array_changes = false;
  std::optional<Extremes> pressure;    ///< known readings of living elements
  std::uint64_t unknown_readings = 0;  ///< NaN readings of living elements
  std::optional<double> elapsed_s;     ///< from the first row to the last, see StreamTime
  std::optional<std::uint64_t> lost;   ///< lost frames, where the file counts them
  std::uint64_t with_pose = 0;
};
RecordingSummary summarize_recording(const std::filesystem::path& path);

struct MapSummary {
  OccupancyGrid head;  ///< without cells
  Extremes log_odds;
  std::uint64_t occupied = 0;  ///< cells with log odds > 0
};
MapSummary summarize_map(const std::filesystem::path& path);

struct PosteriorSummary {
  /// The most likely bin of an object.
  struct Peak {
    double log_likelihood;
    std::int64_t bin;
  };
  Posterior head;  ///< without log-likelihoods
  std::vector<Peak> peaks;
};
PosteriorSummary summarize_posterior(const std::filesystem::path& path);

}  // namespace palpate
