#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "io/csv_table.hpp"

namespace palpate {

/// The columns that a text names, in its order: names, or numbers counted from 1; FIRST:LAST;
/// START::STEP, every STEP-th from START on; patterns in which `*` is any text and `{n}` a number,
/// by which the columns are ordered; and beginnings of names. Commas separate them.
/// @param taken columns that hold something else, which FIRST:LAST may not cross
/// @param option that gives the text, for messages: "pressure-columns"
/// @throws Error where a part names no column, or one twice
std::vector<std::size_t> choose_columns(const CsvTable& table, const std::string& text,
                                        const std::vector<std::size_t>& taken, const char* option);

}  // namespace palpate
