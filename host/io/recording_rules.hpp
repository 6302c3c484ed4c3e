#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "model/refuse.hpp"
#include "palpate/touch.hpp"

namespace palpate {

// Rules for recordings, the same for reading, writing and recording: what may be written may be
// read. Each function throws Error (Fault::input), which names the file, the field and the remedy.

/// Requires printable UTF-8; `field` is such as "attribute 'object'".
void require_text(const std::filesystem::path& path, std::string_view field, std::string_view text);

/// Requires sound texts, units, truth and baseline: all but the rows.
/// @param elements number of elements of the array
void require_head(const std::filesystem::path& path, const Recording& head, std::size_t elements);

/// Requires finite places. @param first index of the first of them
void require_elements(const std::filesystem::path& path, std::size_t first,
                      std::span<const glm::dvec2> elements_mm);

/// Requires sound rows. Pressures of living elements and poses are finite or, in a stream of
/// frames, NaN (Unknown); times of the sensor's own clock may be NaN (unknown).
/// @param head holds `valid` of all rows
/// @param rows some of the recording's rows; may be `head`
/// @param first_row index of the first of them
void require_rows(const std::filesystem::path& path, const Recording& head, std::size_t elements,
                  const Recording& rows, std::size_t first_row);

/// Refuses a raw stream, whose rows are frames.
void require_rows_of_touches(const Recording& recording);

}  // namespace palpate
