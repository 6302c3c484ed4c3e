#include "cli/text_table.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "model/printable.hpp"

namespace palpate::cli {

namespace {

bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

/// The first `columns` characters.
std::string_view head(std::string_view text, std::size_t columns) {
  std::size_t end = 0;
  while (end < text.size() && (columns > 0 || !begins_character(text[end]))) {
    columns -= begins_character(text[end]) ? 1 : 0;
    ++end;
  }
  return text.substr(0, end);
}

}  // namespace

std::string shorten_middle(std::string_view text, std::size_t columns) {
  constexpr std::string_view ellipsis = "...";
  const std::size_t length = columns_of(text);
  if (length <= columns) {
    return std::string(text);
  }
  if (columns <= ellipsis.size()) {
    return std::string(head(text, columns));
  }
  const std::size_t kept = columns - ellipsis.size();
  const std::size_t tail = kept / 2;
  const std::size_t tail_begin = head(text, length - tail).size();
  return std::string(head(text, kept - tail)) + std::string(ellipsis) +
         std::string(text.substr(tail_begin));
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

std::string count_of(std::size_t count, const char* one, const char* more) {
  return fmt::format("{} {}", count, count == 1 ? one : more);
}

TextTable::TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

void TextTable::add(const std::vector<std::string>& cells) {
  std::vector<std::string>& row = rows_.emplace_back();
  for (const std::string& cell : cells) {
    row.push_back(printable(cell));
  }
}

std::string TextTable::text() const {
  constexpr std::size_t gap = 2;
  std::vector<std::size_t> widths(columns_.size(), 0);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    for (const std::vector<std::string>& row : rows_) {
      widths[k] = std::max(widths[k], columns_of(row[k]));
    }
    if (widths[k] > 0) {
      widths[k] = std::max(widths[k], columns_of(columns_[k].heading));
    }
  }
  std::string text;
  const auto add_line = [&](const auto& cell_of) {
    std::string line;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      if (widths[k] == 0) {
        continue;
      }
      const std::string& cell = cell_of(k);
      const std::string blanks(widths[k] - columns_of(cell), ' ');
      line += columns_[k].right ? blanks + cell : cell + blanks;
      line += std::string(gap, ' ');
    }
    line.resize(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  };
  add_line([&](std::size_t k) -> const std::string& { return columns_[k].heading; });
  for (const std::vector<std::string>& row : rows_) {
    add_line([&](std::size_t k) -> const std::string& { return row[k]; });
  }
  return text;
}

}  // namespace palpate::cli
