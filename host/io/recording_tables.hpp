#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "palpate/touch.hpp"

namespace palpate {

/// Writes a recording as CSV files from which `palpate import` makes the same recording:
/// pressures.csv (time, device_time, lost_before, p0, p1, ...), array.csv (x_mm, y_mm, valid,
/// baseline) and poses.csv (x_mm, y_mm, theta_rad). Numbers have as many
/// digits as float64 needs; unknown readings and poses are empty cells, single dead readings too.
/// The files appear when all of them are written.
/// @throws Error where the elements move from row to row, which none of these tables can hold, or a
/// file cannot be written
void write_tables(const std::filesystem::path& folder, const Recording& recording);

/// Names of the files that write_tables() writes.
std::vector<std::string> table_names();

}  // namespace palpate
