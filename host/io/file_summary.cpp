#include "io/file_summary.hpp"

#include <limits>
#include <optional>

#include "io/map_file.hpp"
#include "io/posterior_file.hpp"

namespace palpate {

MapSummary summarize_map(const std::filesystem::path& path) {
  MapSummary summary;
  std::optional<Extremes> log_odds;
  scan_map(
      path, [&](const OccupancyGrid& head) { summary.head = head; },
      [&](std::span<const float> cells) {
        for (const float cell : cells) {
          widen(log_odds, cell);
          summary.occupied += cell > 0.0F ? 1 : 0;
        }
      });
  summary.log_odds = log_odds.value();  // no map is without cells
  return summary;
}

PosteriorSummary summarize_posterior(const std::filesystem::path& path) {
  PosteriorSummary summary;
  std::size_t bins = 0;
  std::size_t k = 0;
  scan_posterior(
      path,
      [&](const Posterior& head) {
        summary.head = head;
        bins = static_cast<std::size_t>(head.lattice.bins());
        summary.peaks.assign(head.objects.size(), {-std::numeric_limits<double>::infinity(), 0});
      },
      [&](std::span<const double> values) {
        for (const double value : values) {
          PosteriorSummary::Peak& peak = summary.peaks[k / bins];
          if (value > peak.log_likelihood) {
            peak = {value, static_cast<std::int64_t>(k % bins)};
          }
          ++k;
        }
      });
  return summary;
}

}  // namespace palpate
