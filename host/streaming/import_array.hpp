#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "io/pressure_table.hpp"
#include "streaming/import_survey.hpp"
#include "streaming/table_import.hpp"

namespace palpate {

/// Columns and rows of `array` where it is a grid of more than one row; none of a file.
std::optional<std::array<std::size_t, 2>> grid_size(const ImportOptions& options);

/// Reads `array`, its elements in the order of their readings, as a grid or as a file, or takes the
/// elements of a program; checks `pressure-unit`.
/// @throws Error naming the option, or the file's line and column
ArrayTable import_array(const ImportOptions& options);

/// Marks as dead the elements without any reading. In touches, which have no unknown readings, it
/// also marks single readings.
/// @throws Error naming `path` where no element has any
void mark_unknown(const std::string& path, const ImportSurvey& survey, Recording& recording);

}  // namespace palpate
