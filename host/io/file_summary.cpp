#include "file_summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lost_count.hpp"
#include "map_file.hpp"
#include "posterior_file.hpp"
#include "recording_scan.hpp"
#include "stream_time.hpp"

namespace palpate {

namespace {

void widen(std::optional<Extremes>& extremes, double value) {
  if (!extremes) {
    extremes = {value, value};
  }
  extremes->least = std::min(extremes->least, value);
  extremes->most = std::max(extremes->most, value);
}

}  // namespace

RecordingSummary summarize_recording(const std::filesystem::path& path) {
  RecordingSummary summary;
  StreamTime time;
  std::size_t k = 0;
  scan_recording(path, {.head =
                            [&](const RecordingHead& head) {
                              summary.head = head.recording;
                              summary.rows = head.rows;
                              summary.elements = head.elements;
                              summary.array_changes = head.array_changes;
                            },
                        .pressure =
                            [&](std::span<const double> values) {
                              const std::vector<std::uint8_t>& valid = summary.head.valid;
                              for (const double value : values) {
                                if (valid.empty() || valid[k % valid.size()] != 0) {
                                  if (std::isnan(value)) {
                                    ++summary.unknown_readings;
                                  } else {
                                    widen(summary.pressure, value);
                                  }
                                }
                                ++k;
                              }
                            },
                        .T_robot_sensor =
                            [&](std::span<const Pose> poses) {
                              summary.with_pose += static_cast<std::uint64_t>(std::count_if(
                                  poses.begin(), poses.end(),
                                  [](const Pose& pose) { return !std::isnan(pose.theta_rad); }));
                            },
                        .elements_mm = [](std::span<const glm::dvec2>) {},
                        .time_s =
                            [&](std::span<const double> times) {
                              for (const double time_s : times) {
                                summary.elapsed_s = time.advance(time_s);
                              }
                            },
                        .device_time_s = [](std::span<const double>) {},
                        .lost_before =
                            [&](std::span<const std::uint64_t> counts) {
                              summary.lost = summary.lost.value_or(0);
                              for (const std::uint64_t count : counts) {
                                count_lost(*summary.lost, count);
                              }
                            }});
  return summary;
}

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
