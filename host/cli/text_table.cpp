#include "cli/text_table.hpp"

#include <algorithm>
#include <numeric>
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

/// The names of a column stay this long, since shorter ones cannot be told apart.
constexpr std::size_t shortest_name = 8;

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

std::string TextTable::text(std::optional<int> columns) const {
  std::vector<std::size_t> widths(columns_.size(), 0);
  std::size_t shown = 0;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    for (const std::vector<std::string>& row : rows_) {
      widths[k] = std::max(widths[k], columns_of(row[k]));
    }
    if (widths[k] > 0) {
      widths[k] = std::max(widths[k], columns_of(columns_[k].heading));
      ++shown;
    }
  }
  std::size_t gap = 2;
  std::vector<std::size_t> below;  // columns whose cells lie below their rows
  if (columns && shown > 0) {
    const auto room = static_cast<std::size_t>(std::max(*columns, 0));
    std::size_t all = std::accumulate(widths.begin(), widths.end(), std::size_t{0});
    gap = all + gap * (shown - 1) > room ? 1 : gap;
    all += gap * (shown - 1);
    const auto spare = [&](std::size_t k) {
      const std::size_t shortest = std::max(shortest_name, columns_of(columns_[k].heading));
      return columns_[k].may_cut ? widths[k] - std::min(widths[k], shortest) : 0;
    };
    std::size_t least = all;  // with the shortest names
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      least -= spare(k);
    }
    const int ranks = std::ranges::max(columns_, {}, &Column::below).below;
    for (int rank = 1; rank <= ranks && least > room; ++rank) {
      for (std::size_t k = 0; k < columns_.size(); ++k) {
        if (columns_[k].below == rank && widths[k] > 0) {
          least -= widths[k] + gap;
          all -= widths[k] + gap;
          widths[k] = 0;
          below.push_back(k);
        }
      }
    }
    for (std::size_t k = 0; k < columns_.size() && all > room; ++k) {
      const std::size_t less = std::min(all - room, spare(k));
      widths[k] -= less;
      all -= less;
    }
    std::ranges::sort(below);
  }

  std::string text;
  const auto add_line = [&](const auto& cell_of) {
    std::string line;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      if (widths[k] == 0) {
        continue;
      }
      const std::string cell = shorten_middle(cell_of(k), widths[k]);
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
    std::string rest;
    for (const std::size_t k : below) {
      if (!row[k].empty() && row[k] != "-") {
        rest += (rest.empty() ? "    " : ", ") +
                (columns_[k].right ? columns_[k].heading + " " : "") + row[k];
      }
    }
    text += rest.empty() ? "" : rest + "\n";
  }
  return text;
}

}  // namespace palpate::cli
