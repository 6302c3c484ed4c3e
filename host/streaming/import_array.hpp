#pragma once

#include <cstddef>
#include <string>

#include "io/pressure_table.hpp"
#include "streaming/table_import.hpp"

namespace palpate {

/// The array of an import, its elements in the order of their readings.
struct ImportArray : ArrayTable {
  std::size_t line =
      0;  ///< readings of one row, or of one column where these come first; 0: no grid
};

/// Reads `array` as a grid or as a file, or takes the elements of a program; checks
/// `pressure-unit`.
/// @throws Error naming the option, or the file's line and column
ImportArray import_array(const ImportOptions& options);

/// Reads pressures [n, e], or [n, lines, line] of a grid, from a file of numpy.save.
/// @throws Error naming the file, where its shape is another or a number infinite
PressureTable read_npy_pressures(const std::string& path, const ImportArray& array);

/// Marks as dead the elements without any reading. In touches, which have no unknown readings, it
/// also marks single readings.
/// @throws Error naming `path` where no element has any
void mark_unknown(const std::string& path, const ImportSurvey& survey, Recording& recording);

}  // namespace palpate
