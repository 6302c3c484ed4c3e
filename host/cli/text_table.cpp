#include "cli/text_table.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "model/printable.hpp"
#include "recognition/evaluation.hpp"

namespace palpate::cli {

namespace {

TextTable::Row printable_cells(const TextTable::Row& cells) {
  TextTable::Row row;
  std::ranges::transform(cells, std::back_inserter(row), printable);
  return row;
}

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
  const std::size_t kept = columns - ellipsis.size();
  const std::size_t tail = kept / 2;
  return std::string(head(text, kept - tail)) + std::string(ellipsis) +
         std::string(text.substr(head(text, length - tail).size()));
}

std::string percent(double share) { return fmt::format("{:.1f} %", 100.0 * share); }

std::string range_words(const Interval& interval) {
  return fmt::format("{:.1f} to {:.1f} %", 100.0 * interval.low, 100.0 * interval.high);
}

std::string count_of(std::size_t count, const char* one, const char* more) {
  return fmt::format("{} {}", count, count == 1 ? one : more);
}

std::string also(std::uint64_t count, const char* words) {
  return count > 0 ? fmt::format(", {} {}", count, words) : "";
}

TextTable::TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

void TextTable::add(const Row& cells) { rows_.push_back(printable_cells(cells)); }

TextTable::Row TextTable::headings() const {
  Row row;
  std::ranges::transform(columns_, std::back_inserter(row), &Column::heading);
  return row;
}

std::string TextTable::line(const Row& cells) const {
  std::vector<std::size_t> widths;
  std::ranges::transform(columns_, std::back_inserter(widths), &Column::width);
  return line(printable_cells(cells), widths);
}

std::string TextTable::line(const Row& cells, const std::vector<std::size_t>& widths) const {
  constexpr std::size_t gap = 2;
  std::string line;
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    if (widths[k] > 0) {
      const std::string blanks(widths[k] - std::min(columns_of(cells[k]), widths[k]), ' ');
      line += columns_[k].right ? blanks + cells[k] : cells[k] + blanks;
      line += std::string(gap, ' ');
    }
  }
  line.resize(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

std::string TextTable::text() const {
  std::vector<std::size_t> widths(columns_.size(), 0);
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    for (const Row& row : rows_) {
      widths[k] = std::max(widths[k], columns_of(row[k]));
    }
    if (widths[k] > 0) {
      widths[k] = std::max(widths[k], columns_of(columns_[k].heading));
    }
  }
  std::string text = line(headings(), widths);
  for (const Row& row : rows_) {
    text += line(row, widths);
  }
  return text;
}

void add_score_rows(TextTable& table, const std::vector<const Scores*>& columns) {
  const auto add = [&](const char* name, auto text_of) {
    std::vector<std::string> cells{name};
    for (const Scores* scores : columns) {
      cells.push_back(scores == nullptr ? std::string() : text_of(*scores));
    }
    table.add(cells);
  };
  add("accuracy", [](const Scores& s) { return percent(s.accuracy()); });
  add("95 % interval", [](const Scores& s) { return range_words(s.interval()); });
  add("log-loss, nats", [](const Scores& s) { return fmt::format("{:.3f}", s.log_loss); });
  add("calibration error",
      [](const Scores& s) { return fmt::format("{:.3f}", s.calibration_error); });
}

}  // namespace palpate::cli
