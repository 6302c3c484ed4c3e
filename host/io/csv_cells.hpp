#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// True for equal texts, upper and lower case alike.
bool alike(std::string_view a, std::string_view b);

/// The text without the blanks around it.
std::string_view trimmed(std::string_view text);

/// The line up to its comment: '#' at its start, or after a number and a blank, not in quotes.
/// Names and labels may hold one, as in 'mug #2'.
std::string_view without_comment(std::string_view line);

/// What separates the cells of a row: tabs, else semicolons, else commas, unless these are decimal
/// ones of numbers between blanks, else blanks.
char separator_of(std::string_view line);

/// Splits a row into its cells, without the quotes and blanks around them.
/// @param cells gets the cells, which are parts of the line
/// @returns what is wrong with the row, nullptr where nothing is
const char* split_cells(std::string_view line, char separator,
                        std::vector<std::string_view>& cells);

/// The finite number in a cell; decimal commas are read where commas do not separate. None where
/// the cell holds anything else.
std::optional<double> number_in(std::string_view cell, char separator);

/// True for a row of numbers, finite or not (1, -2.5, inf, nan, 1e999), and of empty cells.
bool are_numbers(const std::vector<std::string_view>& cells, char separator);

/// Where rows of a table begin in a text that may hold other lines before them.
struct TableStart {
  std::size_t first = 0;  ///< index of the row that is the first, or the header
  char separator = ',';
};

/// Finds the table in the first lines of a text: its rows have equally many cells, as most of the
/// lines have, or those below other lines that have fewer or another separator; the first line with
/// as many is its header, unless less than half of it is filled.
/// @param lines none blank, without comments; at least one
TableStart find_table(const std::vector<std::string>& lines);

/// True where a row holds names: no number, or numbers that count 0, 1, 2, ... (five at least), as
/// pandas names the columns of an array.
bool is_header(const std::vector<std::string_view>& cells, char separator);

}  // namespace palpate
