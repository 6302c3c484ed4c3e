#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "palpate/touch.hpp"

namespace palpate {

// Rules for recordings, the same for reading, writing and recording: what may be written may be
// read. Each function throws Error (Fault::input), which names the file, the field and the remedy.

/// Requires printable UTF-8; `field` is such as "attribute 'object'".
void require_text(const std::filesystem::path& path, std::string_view field, std::string_view text);

/// Requires sound texts, units, truth and baseline: all but the rows.
/// @param elements number of elements of the array
void require_head(const std::filesystem::path& path, const Recording& head, std::size_t elements);

// The functions below check some of the rows; `first` is the index of the first value among all.

/// Pressures [n, e] of living elements are finite or, in a stream of frames, NaN (Unknown). Uses
/// `head.valid`.
void require_pressures(const std::filesystem::path& path, const Recording& head,
                       std::size_t elements, std::size_t first, std::span<const double> pressure);
/// Poses are finite or, in a stream of frames, all NaN (unknown at that time).
void require_poses(const std::filesystem::path& path, const Recording& head, std::size_t first,
                   std::span<const Pose> T_robot_sensor);
void require_elements(const std::filesystem::path& path, std::size_t first,
                      std::span<const glm::dvec2> elements_mm);
void require_times(const std::filesystem::path& path, std::size_t first,
                   std::span<const double> time_s);
/// Times of the sensor's own clock may be NaN (unknown).
void require_device_times(const std::filesystem::path& path, std::size_t first,
                          std::span<const double> device_time_s);
void require_lost_counts(const std::filesystem::path& path, std::size_t first,
                         std::span<const std::uint64_t> lost_before);

/// Refuses a raw stream, whose rows are frames.
void require_rows_of_touches(const Recording& recording);

bool is_finite(const Pose& pose);

}  // namespace palpate
