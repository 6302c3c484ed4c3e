#pragma once

#include <cstddef>
#include <optional>
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
    bool right = false;    ///< aligned to the right
    bool may_cut = false;  ///< holds names, which shorten_middle() may cut
    /// Columns of the least rank above 0 are the first to go below their rows where the terminal is
    /// too narrow, all of a rank together.
    int below = 0;
  };

  explicit TextTable(std::vector<Column> columns);

  /// Adds a row, a cell per column. Bytes that cannot be shown become '?'.
  void add(const std::vector<std::string>& cells);

  /// The heading and the rows, each with a line end.
  /// @param columns of the terminal: where the table is wider, it gets one blank instead of two
  /// between its columns, then shorter names, then what may lie below its row in a line of its own:
  /// numbers after their headings, words alone. Without a number nothing is shortened.
  std::string text(std::optional<int> columns) const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace palpate::cli
