#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/csv_cells.hpp"
#include "io/input_file.hpp"
#include "model/descriptor.hpp"

namespace palpate {

/// Reads the lines of a text file in constant memory: UTF-8, or UTF-16 with a byte order mark, as
/// spreadsheets save it.
class TextLines {
 public:
  /// @throws Error where the file cannot be read
  explicit TextLines(std::filesystem::path path);

  /// Goes on to the next line; false after the last.
  /// @throws Error where the file cannot be read, is no text, or a line is longer than 16 MB
  bool next();
  /// The line without its end; valid until next().
  std::string_view line() const { return line_; }
  std::uint64_t number() const { return number_; }  ///< of the line, from 1

 private:
  void read_block();
  void append_utf16(std::string_view bytes);

  std::filesystem::path path_;
  Descriptor file_;
  enum class Encoding { unknown, utf8, utf16_little, utf16_big } encoding_ = Encoding::unknown;
  std::string left_;       ///< of UTF-16: bytes of a character whose rest is not read yet
  std::string block_;      ///< text in UTF-8, from the present line on
  std::size_t begin_ = 0;  ///< where the next line begins in block_
  bool at_end_ = false;    ///< the whole file is in block_
  std::string_view line_;
  std::uint64_t number_ = 0;
};

/// Reads a table of numbers from a text file, row by row, in constant memory.
///
/// Cells are separated by tabs, semicolons, commas or blanks. The table begins at the first line
/// that has as many cells as its rows (see find_table()); what stands before it is skipped, and
/// `sep=;` names the separator, as spreadsheets write it. The first row is the header where it
/// holds names and no number, or where its numbers count 0, 1, 2, ... (five at least); "inf" and
/// "nan" are numbers. '#' at the start of a line or after a number begins a comment. Empty lines, a
/// byte order mark, UTF-16, CRLF, quotes around a cell and a separator after the last cell of a row
/// are accepted; so are decimal commas where commas do not separate. Every error is one line that
/// names the file, the line and the column.
class CsvTable {
 public:
  /// @param header_line number of the line that holds the names, from 1; 0: it is found; none: so,
  /// and there is no option `header-line`
  /// @throws Error where the file cannot be read, is not text or holds no row
  explicit CsvTable(std::filesystem::path path, std::optional<std::uint64_t> header_line = {});

  const std::filesystem::path& path() const { return path_; }
  bool has_header() const { return has_header_; }
  /// Names of the columns; "1", "2", ... where the table has no header.
  const std::vector<std::string>& columns() const { return columns_; }
  /// Returns the column of this name, else of this name in upper and lower case alike; none where
  /// there is none.
  std::optional<std::size_t> find(std::string_view name) const;
  /// As find(), or else the column of this number, counted from 1.
  std::optional<std::size_t> find_or_count(std::string_view name) const;
  /// Lines before the header, or before the first row, that hold something else than a comment.
  std::uint64_t skipped_lines() const { return skipped_lines_; }
  /// Number of the line that holds the names, or of the first row.
  std::uint64_t header_number() const { return header_number_; }
  /// Its first cells, "'time', 'p0', 'p1', ...".
  const std::string& header_words() const { return header_words_; }

  /// Passes over the rows whose cell in the column is not this text, or this number.
  void keep_where(std::size_t column, std::string value);

  /// Goes on to the next row; false after the last.
  /// @throws Error where the row has more or fewer cells than the first
  bool next();
  /// As next(), of a text in which rows stand between other lines: passes over lines that are no
  /// numbers, or more or fewer than the columns.
  /// @param passed whether lines were passed over, blank ones too
  bool next_numbers(bool& passed);
  /// Returns the number in a cell of the row; none where the cell is empty or NaN.
  /// @throws Error where the cell holds anything else than a finite number
  std::optional<double> number(std::size_t column) const;
  /// Returns what number() does; the cell may not be empty.
  double require_number(std::size_t column) const;

  /// Returns the text of a cell of the row, without the quotes around it; valid until next().
  std::string_view text(std::size_t column) const { return cells_[column]; }
  /// True where a cell of the row is this text, or this number.
  bool holds(std::size_t column, std::string_view value) const;
  std::uint64_t line_number() const { return number_; }  ///< of the row, from 1

  /// Throws Error that names the row's line and the message, formatted as by fmt::format().
  template <typename... Parts>
  [[noreturn]] void refuse(fmt::format_string<const Parts&...> message,
                           const Parts&... parts) const {
    palpate::refuse(place(), message, parts...);
  }
  /// As refuse(), of the columns: names the line that is taken for the header, and shows it.
  template <typename... Parts>
  [[noreturn]] void refuse_columns(fmt::format_string<const Parts&...> message,
                                   const Parts&... parts) const {
    palpate::refuse(fmt::format("{}:{}", path_.string(), header_number_),
                    "{}; the {} there is {}{}", fmt::format(message, parts...),
                    has_header_ ? "header" : "first row", header_words(),
                    may_name_header_ ? " (or give `header-line`)" : "");
  }

  /// The file's lines, at least as many as its rows: for reserving memory.
  /// @throws Error as next()
  std::uint64_t count_lines() const;

 private:
  bool next_line();
  void split();
  bool has_width();
  void find_start(std::uint64_t header_line);
  void name_columns();
  bool is_kept() const;
  std::string place() const;

  std::filesystem::path path_;
  TextLines lines_;
  bool may_name_header_ = false;
  std::string_view line_;     ///< without its comment
  std::uint64_t number_ = 0;  ///< of the line
  std::uint64_t skipped_lines_ = 0;
  std::uint64_t header_number_ = 0;
  char separator_ = ',';
  bool has_header_ = false;
  bool row_is_ready_ = false;  ///< the first row, which was no header
  bool row_is_first_ = false;  ///< the row is the table's first, which was no header
  std::vector<std::string> columns_;
  std::string header_words_;
  std::vector<std::string_view> cells_;
  std::vector<std::pair<std::size_t, std::string>> kept_;
};

}  // namespace palpate
