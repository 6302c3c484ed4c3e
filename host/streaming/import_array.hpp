#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/pressure_table.hpp"
#include "streaming/table_import.hpp"

namespace palpate {

/// What an import has to know of all readings.
struct ImportSurvey {
  /// [n] how far the most loaded living element reads above its least reading so far.
  std::vector<float> load;
  std::vector<std::uint8_t> read;  ///< [e] 1: has a reading, dead or not
  /// The largest reading where all are whole numbers and some are large, as raw ones are.
  std::optional<double> whole_up_to;

  std::size_t rows() const { return load.size(); }
  /// [n] whether the array is pressed: at least half as much as in any row.
  std::vector<bool> pressed() const;
};
/// @param recording its elements, pressures (NaN: Unknown) and `valid`, which is empty or [e]
ImportSurvey survey_of(const Recording& recording);

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
