#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/descriptor.hpp"
#include "io/input_file.hpp"

namespace palpate {

/// True for equal texts, upper and lower case alike.
bool alike(std::string_view a, std::string_view b);

/// Reads a table of numbers from a text file, row by row, in constant memory.
///
/// The first row decides: cells are separated by tabs, else by semicolons, else by commas, else by
/// blanks. The first row is the header where it holds names and no number, or where its numbers
/// count 0, 1, 2, ... (five at least); "inf" and "nan" are numbers. '#' at the start of a line or
/// after a blank begins a comment. Empty lines, a byte order mark, CRLF, quotes around a cell and a
/// separator after the last cell of a row are accepted; so are decimal commas where commas do not
/// separate. Every error is one line that names the file, the line and the column.
class CsvTable {
 public:
  /// @throws Error where the file cannot be read, is not text or holds no row
  explicit CsvTable(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }
  bool has_header() const { return has_header_; }
  /// Names of the columns; "1", "2", ... where the table has no header.
  const std::vector<std::string>& columns() const { return columns_; }
  /// Returns the column of this name, else of this name in upper and lower case alike; none where
  /// there is none.
  std::optional<std::size_t> find(std::string_view name) const;

  /// Goes on to the next row; false after the last.
  /// @throws Error where the row has more or fewer cells than the first
  bool next();
  /// Returns the number in a cell of the row; none where the cell is empty or NaN.
  /// @throws Error where the cell holds anything else than a finite number
  std::optional<double> number(std::size_t column) const;
  /// Returns what number() does; the cell may not be empty.
  double require_number(std::size_t column) const;

  /// Returns the text of a cell of the row, without the quotes around it; valid until next().
  std::string_view text(std::size_t column) const { return cells_[column]; }

  /// Throws Error that names the row's line and the message, formatted as by fmt::format().
  template <typename... Parts>
  [[noreturn]] void refuse(fmt::format_string<const Parts&...> message,
                           const Parts&... parts) const {
    palpate::refuse(place(), message, parts...);
  }

  /// Returns at least the number of rows that are left, for reserving memory.
  /// @throws Error where the file cannot be read
  std::uint64_t count_lines() const;

 private:
  bool next_line();
  void read_block();
  void split(std::string_view line);
  void name_columns();
  bool is_header() const;
  std::string place() const;

  std::filesystem::path path_;
  Descriptor file_;
  std::string block_;      ///< bytes read, from the present line on
  std::size_t begin_ = 0;  ///< where the next line begins in block_
  bool at_end_ = false;    ///< the whole file is in block_
  std::string_view line_;
  std::uint64_t line_number_ = 0;
  char separator_ = ',';
  bool has_header_ = false;
  bool row_is_ready_ = false;  ///< the first row, which was no header
  bool row_is_first_ = false;  ///< the row is the table's first, which was no header
  std::vector<std::string> columns_;
  std::vector<std::string_view> cells_;
};

}  // namespace palpate
