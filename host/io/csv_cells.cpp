#include "io/csv_cells.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "model/number_text.hpp"

namespace palpate {

namespace {

constexpr std::string_view blanks = " \t\r\v\f";

/// Index of the quote that ends the text in quotes from `begin` on; npos where none does.
std::size_t closing_quote(std::string_view line, std::size_t begin) {
  std::size_t at = line.find('"', begin + 1);
  while (at != line.npos && at + 1 < line.size() && line[at + 1] == '"') {
    at = line.find('"', at + 2);  // a doubled quote stands for itself
  }
  return at;
}

/// The cells, with the empty one behind a last separator; none where the line is no row.
std::vector<std::string_view> cells_in(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  const bool is_row = split_cells(line, separator, cells) == nullptr;
  return is_row ? cells : std::vector<std::string_view>();
}

/// True for the text of a number, finite or not.
bool is_numeric(std::string_view cell, char separator) {
  std::string text(cell.substr(cell.starts_with('+') ? 1 : 0));
  if (separator != ',') {
    std::ranges::replace(text, ',', '.');
  }
  double number = 0.0;
  const char* const end = text.data() + text.size();
  return !text.empty() && std::from_chars(text.data(), end, number).ptr == end;
}

bool is_half_empty(const std::vector<std::string_view>& cells) {
  return 2 * static_cast<std::size_t>(std::ranges::count(cells, std::string_view())) >=
         cells.size();
}

}  // namespace

bool alike(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

std::string_view without_comment(std::string_view line) {
  if (line.find('#') == line.npos) {
    return line;
  }
  for (std::size_t at = 0; at < line.size(); ++at) {
    const std::string_view before = line.substr(0, at);
    if (line[at] == '"') {
      at = std::min(closing_quote(line, at), line.size());
    } else if (line[at] == '#' && trimmed(before).empty()) {
      return before;
    } else if (line[at] == '#' && blanks.find(before.back()) != blanks.npos) {
      const char separator = separator_of(before);
      const auto cells = cells_in(before, separator);
      if (!cells.empty() && is_numeric(cells.back(), separator)) {
        return before;
      }
    }
  }
  return line;
}

char separator_of(std::string_view line) {
  std::string bare;
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (line[at] == '"') {
      at = std::min(closing_quote(line, at), line.size());
    } else {
      bare += line[at];
    }
  }
  for (const char separator : {'\t', ';', ','}) {
    if (bare.find(separator) != bare.npos) {
      // Numbers with decimal commas between blanks are none between commas.
      const auto cells = cells_in(bare, ' ');
      const bool is_decimal = separator == ',' && cells.size() > 1 && are_numbers(cells, ' ') &&
                              !are_numbers(cells_in(bare, ','), ',');
      return is_decimal ? ' ' : separator;
    }
  }
  return ' ';
}

const char* split_cells(std::string_view line, char separator,
                        std::vector<std::string_view>& cells) {
  cells.clear();
  if (separator == ' ') {
    line = trimmed(line);
  }
  for (std::size_t at = 0;;) {
    const std::size_t begin = line.find_first_not_of(separator == '\t' ? " \r" : blanks, at);
    if (begin != line.npos && line[begin] == '"') {
      const std::size_t quote = closing_quote(line, begin);
      if (quote == line.npos) {
        return "a quote is not closed; close it in the line in which it opens";
      }
      cells.push_back(trimmed(line.substr(begin + 1, quote - begin - 1)));
      at = quote + 1;
      if (separator != ' ' && !trimmed(line.substr(at, line.find(separator, at) - at)).empty()) {
        return "text follows a closing quote; put the whole cell in quotes";
      }
      at = separator == ' ' ? at : line.find(separator, at);
    } else {
      const std::size_t start = separator == ' ' ? begin : at;
      const std::size_t end =
          separator == ' ' ? line.find_first_of(blanks, start) : line.find(separator, start);
      cells.push_back(trimmed(line.substr(start, end - start)));
      at = end;
    }
    if (at >= line.size()) {
      return nullptr;  // npos too
    }
    ++at;
    if (separator == ' ' && line.find_first_not_of(blanks, at) == line.npos) {
      return nullptr;
    }
  }
}

std::optional<double> number_in(std::string_view cell, char separator) {
  if (separator == ',' || cell.find(',') == cell.npos) {
    return number_of(cell);
  }
  std::string with_point(cell);
  std::ranges::replace(with_point, ',', '.');
  return number_of(with_point);
}

bool are_numbers(const std::vector<std::string_view>& cells, char separator) {
  return std::ranges::all_of(
      cells, [&](std::string_view cell) { return cell.empty() || is_numeric(cell, separator); });
}

bool is_header(const std::vector<std::string_view>& cells, char separator) {
  bool counts = true;
  std::size_t numbers = 0;
  std::size_t names = 0;
  for (const std::string_view cell : cells) {
    if (is_numeric(cell, separator)) {
      counts = counts && cell == fmt::format_int(numbers).c_str();
      ++numbers;
    } else {
      names += cell.empty() ? 0 : 1;
    }
  }
  if (numbers == 0) {
    return names > 0;
  }
  // pandas names the columns of an array by counting, beside the names of other columns. A short
  // row that counts may be a pose.
  constexpr std::size_t enough = 5;
  return counts && numbers >= enough;
}

TableStart find_table(const std::vector<std::string>& lines) {
  // Rows have one separator and one width; what comes before them has others.
  const char own = separator_of(lines.front());
  if (const auto cells = cells_in(lines.front(), own);
      cells.size() > 1 && are_numbers(cells, own) && !is_half_empty(cells) &&
      (lines.size() == 1 || cells_in(lines[1], own).size() == cells.size())) {
    return {.first = 0, .separator = own};
  }
  // Of a separator and a width: how many lines, and the first of them.
  std::map<std::pair<char, std::size_t>, std::pair<std::size_t, std::size_t>> forms;
  std::pair<char, std::size_t> shape{own, 0};
  std::size_t largest = 0;
  std::size_t last = 0;  // of this shape
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const char separator = separator_of(lines[i]);
    const std::size_t width = cells_in(lines[i], separator).size();
    auto& [count, first] = forms.try_emplace({separator, width}, 0, i).first->second;
    count += width == 0 ? 0 : 1;
    const bool is_below = count > 1 && first > last &&
                          (separator == shape.first ? width > shape.second : separator != ' ');
    // Of shapes as frequent the one that comes last, but for lines that have no separator.
    if (count > largest || (count == largest && width > 1) || is_below) {
      largest = count;
      shape = {separator, width};
    }
    last = shape == std::pair{separator, width} ? i : last;
  }
  const char separator = shape.first;
  TableStart start{.first = 0, .separator = separator};
  const auto has_width = [&](std::size_t i) {
    return cells_in(lines[i], separator).size() == shape.second;
  };
  bool is_row = false;  // one that is short, not a line before a table
  while (start.first < lines.size() && !has_width(start.first)) {
    const auto cells = cells_in(lines[start.first++], separator);
    is_row = is_row || (cells.size() > 1 && are_numbers(cells, separator));
  }
  if (start.first == lines.size() ||
      (is_row && !is_header(cells_in(lines[start.first], separator), separator))) {
    return {.first = 0, .separator = separator};
  }
  // A spreadsheet fills up the lines before its table with empty cells.
  for (std::size_t i = start.first; i + 1 < lines.size() && has_width(i); ++i) {
    const auto cells = cells_in(lines[i], separator);
    if (!is_half_empty(cells)) {
      start.first = is_header(cells, separator) ? i : start.first;
      break;
    }
  }
  // Names just before numbers are their header, even where they are too few or too many.
  const auto cells = cells_in(lines[start.first], separator);
  if (start.first > 0 && !is_header(cells, separator)) {
    const auto before = cells_in(lines[start.first - 1], separator);
    start.first -= before.size() > 1 && is_header(before, separator) ? 1 : 0;
  }
  return start;
}

}  // namespace palpate
