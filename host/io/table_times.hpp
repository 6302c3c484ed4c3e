#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "io/table_columns.hpp"

namespace palpate {

/// A row at which the clock of a table steps back.
struct ClockStep {
  std::size_t row = 0;     ///< the first of the new stretch, of those that are read
  std::uint64_t line = 0;  ///< of the file
  double from_s = 0.0;
  double to_s = 0.0;
};

/// Seconds of a date and time by ISO 8601, such as 2026-11-29T12:41:27.5+01:00, since the Unix
/// epoch (without an offset as of UTC), or of a time of day, such as 12:41:27,5, since midnight;
/// none where the text is neither.
/// @param of_day gets whether it is a time of day
std::optional<double> clock_time_of(std::string_view text, bool& of_day);

/// Reads the times of a table's rows, in numbers or as clocks write them.
class TableTimes {
 public:
  TableTimes(const CsvTable& table, const UnitColumn& column) : table_(table), column_(column) {}

  /// Returns the row's time in seconds, and notes where it is earlier than that of the row before.
  /// Times of day go on after midnight.
  /// @param row of those that are read
  /// @throws Error where the cell holds no time, or more than ten rows are earlier than the row
  /// before
  double next(std::size_t row);

  std::vector<ClockStep> steps;

 private:
  const CsvTable& table_;
  UnitColumn column_;
  double last_s_ = 0.0;
  double days_s_ = 0.0;  ///< of times of day, since the first row
  bool first_ = true;
};

}  // namespace palpate
