#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "model/extremes.hpp"
#include "palpate/files.hpp"

namespace palpate {

// Summaries of files. Each function reads the whole file in pieces, holds a few MB of it, and
// throws Error as the file's reader does.

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
