#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "io/table_columns.hpp"

namespace palpate {

/// The columns that a text names, in its order: names, or numbers counted from 1; FIRST:LAST;
/// START::STEP, every STEP-th from START on; patterns in which `*` is any text and `{n}` a number,
/// by which the columns are ordered; and beginnings of names. Commas separate them.
/// @param taken columns that hold something else, which FIRST:LAST may not cross
/// @param option that gives the text, for messages: "pressure-columns"
/// @throws Error where a part names no column, or one twice
std::vector<std::size_t> choose_columns(const CsvTable& table, const std::string& text,
                                        const std::vector<std::size_t>& taken, const char* option);

/// For each element the columns of the axes of which its reading is made: one, or x, y and z.
using PressureColumns = std::vector<std::vector<std::size_t>>;

/// The columns of each element among those of the pressures.
/// @throws Error where they are more or fewer than the elements, or not in their order
PressureColumns pressure_columns(const CsvTable& table, const std::vector<std::size_t>& columns,
                                 std::size_t elements, const TableOptions& options);

/// True where the rows are as wide as the array's grid.
bool is_of_blocks(const CsvTable& table, const TableOptions& options);

/// The reading of the row in the columns of an element, NaN where it is unknown: of the last axis,
/// or the length of the vector.
double reading_in(const CsvTable& table, const std::vector<std::size_t>& axes, bool is_norm);

}  // namespace palpate
