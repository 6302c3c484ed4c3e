#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {
struct Interval;
struct Scores;
}  // namespace palpate

namespace palpate::cli {

/// The text, or its beginning and end with "..." between them, in at most `columns` columns, 3 or
/// more. Every character counts as one column.
std::string shorten_middle(std::string_view text, std::size_t columns);

/// A share as "12.3 %".
std::string percent(double share);
/// "61.2 to 95.0 %"
std::string range_words(const Interval& interval);
/// A count with its noun: "1 record", "2 records".
std::string count_of(std::size_t count, const char* one, const char* more);
/// ", 12 lost", or nothing where the count is 0.
std::string also(std::uint64_t count, const char* words);

/// A table for people. Every column is as wide as its longest cell; a column without any content is
/// left out. Bytes that cannot be shown become '?'.
class TextTable {
 public:
  using Row = std::vector<std::string>;
  struct Column {
    std::string heading;
    bool right = false;     ///< aligned to the right
    std::size_t width = 0;  ///< of line(); 0 leaves the column out there
  };

  explicit TextTable(std::vector<Column> columns);

  /// Adds a row, a cell per column.
  void add(const Row& cells);
  /// The heading and the rows, each with a line end.
  std::string text() const;

  /// The headings as a row.
  Row headings() const;
  /// A row by itself in columns of Column::width, for tables that grow as they are read.
  std::string line(const Row& cells) const;

 private:
  std::string line(const Row& cells, const std::vector<std::size_t>& widths) const;

  std::vector<Column> columns_;
  std::vector<Row> rows_;
};

/// Adds what scores say of some records: accuracy and its interval, log-loss, calibration error.
/// @param columns of the table after the first; null: an empty cell
void add_score_rows(TextTable& table, const std::vector<const Scores*>& columns);

}  // namespace palpate::cli
