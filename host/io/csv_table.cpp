#include "io/csv_table.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <utility>

#include <fmt/ranges.h>

#include "model/descriptor.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

// Lines that show where a table begins.
constexpr std::size_t enough_lines = 200;

bool is_unknown(std::string_view cell) { return cell.empty() || alike(cell, "nan"); }

/// The separator that a spreadsheet's first line "sep=;" names.
std::optional<char> separator_named(std::string_view line) {
  constexpr std::string_view key = "sep=";
  const bool names_it = line.size() > key.size() && alike(line.substr(0, key.size()), key) &&
                        trimmed(line.substr(key.size() + 1)).empty();
  return names_it ? std::optional(line[key.size()]) : std::nullopt;
}

}  // namespace

CsvTable::CsvTable(std::filesystem::path path, std::uint64_t header_line)
    : path_(std::move(path)), lines_(path_) {
  find_start(header_line);
  split();
  has_header_ = header_line > 0 || is_header(cells_, separator_);
  name_columns();
  row_is_ready_ = !has_header_;
}

/// Goes on to the first line of the table.
void CsvTable::find_start(std::uint64_t header_line) {
  std::vector<std::string> lines;
  std::vector<std::uint64_t> numbers;
  std::optional<char> named;
  while (lines.size() < enough_lines + header_line && next_line()) {
    named = numbers.empty() && !named ? separator_named(line_) : named;
    if (named && lines.empty() && separator_named(line_)) {
      ++skipped_lines_;
      continue;
    }
    if (number_ >= header_line) {
      lines.emplace_back(line_);
      numbers.push_back(number_);
    }
  }
  if (header_line > 0 && (numbers.empty() || numbers.front() != header_line)) {
    palpate::refuse(fmt::format("`header-line {}`", header_line),
                    "{} has no such line, or nothing stands in it; give the number of the line "
                    "with the columns' names, from 1",
                    path_.string());
  }
  if (lines.empty()) {
    palpate::refuse(path_, "holds no row; write at least one");
  }
  TableStart start = find_table(lines);
  if (header_line > 0) {
    start = {.first = 0, .separator = separator_of(lines.front())};
  }
  separator_ = named.value_or(start.separator);
  skipped_lines_ += start.first;
  header_number_ = numbers[start.first];
  lines_ = TextLines(path_);
  number_ = 0;
  while (number_ < header_number_) {
    next_line();
  }
}

void CsvTable::name_columns() {
  if (has_header_ && cells_.size() > 1 && cells_.back().empty()) {
    cells_.pop_back();  // a separator ends each row
  }
  first_cells_.assign(cells_.begin(), cells_.end());
  std::set<std::string> seen;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    columns_.push_back(has_header_ ? std::string(cells_[i]) : std::to_string(i + 1));
    const std::string& name = columns_.back();
    if (!name.empty() && !seen.insert(name).second) {
      refuse_columns("two columns are called '{}'; rename one", printable(name));
    }
  }
}

std::string CsvTable::header_words() const {
  constexpr std::size_t enough = 4;
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < std::min(enough, first_cells_.size()); ++i) {
    shown.push_back(fmt::format("'{}'", printable(first_cells_[i])));
  }
  return fmt::format("{}{}", fmt::join(shown, ", "), first_cells_.size() > enough ? ", ..." : "");
}

std::optional<std::size_t> CsvTable::find(std::string_view name) const {
  auto found = std::ranges::find(columns_, name);
  if (found == columns_.end()) {
    found = std::ranges::find_if(columns_,
                                 [name](const std::string& column) { return alike(column, name); });
  }
  return found == columns_.end() ? std::nullopt
                                 : std::optional<std::size_t>(found - columns_.begin());
}

std::optional<std::size_t> CsvTable::find_or_count(std::string_view name) const {
  if (const auto found = find(name)) {
    return found;
  }
  const auto number = whole_number_of(name);
  const bool is_column =
      number && *number >= 1 && static_cast<std::size_t>(*number) <= columns_.size();
  return is_column ? std::optional(static_cast<std::size_t>(*number) - 1) : std::nullopt;
}

void CsvTable::keep_where(std::size_t column, std::string value) {
  kept_.emplace_back(column, std::move(value));
}

bool CsvTable::is_kept() const {
  return std::ranges::all_of(kept_, [&](const auto& where) {
    const auto& [column, value] = where;
    const auto number = number_in(value, separator_);
    return cells_[column] == value || (number && number_in(cells_[column], separator_) == number);
  });
}

/// The row's cells, without an empty one behind a last separator; false where they are more or
/// fewer than the columns.
bool CsvTable::has_width() {
  if (cells_.size() == columns_.size() + 1 && cells_.back().empty()) {
    cells_.pop_back();
  }
  return cells_.size() == columns_.size();
}

bool CsvTable::next() {
  do {
    row_is_first_ = std::exchange(row_is_ready_, false);
    if (!row_is_first_) {
      if (!next_line()) {
        return false;
      }
      split();
      if (!has_width()) {
        refuse("the row has {} cells, the first row {}; write the same columns in every row",
               cells_.size(), columns_.size());
      }
    }
  } while (!is_kept());
  return true;
}

bool CsvTable::next_numbers(bool& passed) {
  passed = false;
  const std::uint64_t before = number_;
  if (std::exchange(row_is_ready_, false)) {
    return true;
  }
  while (next_line()) {
    if (split_cells(line_, separator_, cells_) == nullptr && has_width() &&
        are_numbers(cells_, separator_)) {
      passed = number_ > before + 1;
      return true;
    }
  }
  return false;
}

std::optional<double> CsvTable::number(std::size_t column) const {
  const std::string_view cell = cells_[column];
  if (is_unknown(cell)) {
    return {};
  }
  const std::optional<double> number = number_in(cell, separator_);
  if (!number) {
    constexpr std::size_t enough = 40;
    refuse("column '{}': '{}' is not a finite number; correct it, or leave the cell empty{}",
           printable(columns_[column]), printable(cell.substr(0, enough)),
           row_is_first_ ? "; in a header, no cell is a number" : "");
  }
  return number;
}

double CsvTable::require_number(std::size_t column) const {
  const std::optional<double> value = number(column);
  if (!value) {
    refuse("column '{}' is empty; write a number", printable(columns_[column]));
  }
  return *value;
}

std::uint64_t CsvTable::count_lines() const {
  constexpr std::size_t block_bytes = 1 << 20;
  const Descriptor file(path_, O_RDONLY);
  std::string bytes(block_bytes, '\0');
  std::uint64_t lines = 1;  // the last line may lack its end
  ssize_t got = 0;
  while ((got = ::read(file.get(), bytes.data(), bytes.size())) > 0) {
    lines += static_cast<std::uint64_t>(std::count(bytes.data(), bytes.data() + got, '\n'));
  }
  if (got < 0) {
    palpate::refuse(path_, "cannot be read: {}; copy or record it again", std::strerror(errno));
  }
  return lines;
}

/// Finds the next line that holds anything: line_, without its comment.
bool CsvTable::next_line() {
  while (lines_.next()) {
    number_ = lines_.number();
    line_ = without_comment(lines_.line());
    if (!trimmed(line_).empty()) {
      return true;
    }
  }
  return false;
}

void CsvTable::split() {
  if (const char* fault = split_cells(line_, separator_, cells_)) {
    refuse("{}", fault);
  }
}

std::string CsvTable::place() const { return fmt::format("{}:{}", path_.string(), number_); }

}  // namespace palpate
