#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace palpate::cli {

/// The text, or its beginning and end with "..." between them, in at most `columns` columns. Every
/// character counts as one column.
std::string shorten_middle(std::string_view text, std::size_t columns);

/// A share as "12.3 %".
std::string percent(double share);
/// A count with its noun: "1 record", "2 records".
std::string count_of(std::size_t count, const char* one, const char* more);

/// A table for people. Every column is as wide as its longest cell; a column without any content is
/// left out.
class TextTable {
 public:
  struct Column {
    std::string heading;
    bool right = false;  ///< aligned to the right
  };

  explicit TextTable(std::vector<Column> columns);

  /// Adds a row, a cell per column. Bytes that cannot be shown become '?'.
  void add(const std::vector<std::string>& cells);

  /// The heading and the rows, each with a line end.
  std::string text() const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace palpate::cli
