#include "io/csv_table.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <cwchar>
#include <locale>
#include <set>
#include <utility>

#include <fmt/ranges.h>

#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

constexpr std::size_t block_bytes = 1 << 20;
// A row of 100,000 numbers is shorter; a file without line ends must not fill the memory.
constexpr std::size_t longest_line = 16 << 20;
// Lines that show where a table begins, unless these are long.
constexpr std::size_t enough_lines = 1000;

/// The separator that a spreadsheet's first line "sep=;" names.
std::optional<char> separator_named(std::string_view line) {
  constexpr std::string_view key = "sep=";
  const bool names_it = line.size() > key.size() && alike(line.substr(0, key.size()), key) &&
                        trimmed(line.substr(key.size() + 1)).empty();
  return names_it ? std::optional(line[key.size()]) : std::nullopt;
}

}  // namespace

TextLines::TextLines(std::filesystem::path path) : path_(std::move(path)) {
  require_readable(path_);
  file_ = Descriptor(path_, O_RDONLY);
  block_.reserve(2 * block_bytes);  // on the heap, so that a line stays where it is as this moves
}

bool TextLines::next() {
  std::size_t end = block_.find('\n', begin_);
  while (end == block_.npos && !at_end_) {
    const std::size_t unread = block_.size() - begin_;
    read_block();
    end = block_.find('\n', unread);
  }
  if (end == block_.npos && begin_ == block_.size()) {
    return false;
  }
  end = std::min(end, block_.size());
  line_ = std::string_view(block_).substr(begin_, end - begin_);
  begin_ = std::min(end + 1, block_.size());
  ++number_;
  return true;
}

void TextLines::read_block() {
  block_.erase(0, begin_);
  begin_ = 0;
  const std::size_t kept = block_.size();
  if (kept > longest_line) {
    refuse(path_, "line {} is longer than 16 MB: this is no table; give one row a line",
           number_ + 1);
  }
  std::string own(block_bytes, '\0');
  const ssize_t got = ::read(file_.get(), own.data(), own.size());
  if (got < 0) {
    refuse(path_, "cannot be read: {}; copy or record it again", std::strerror(errno));
  }
  std::string_view bytes(own.data(), static_cast<std::size_t>(got));
  at_end_ = bytes.empty();
  if (encoding_ == Encoding::unknown) {
    encoding_ = Encoding::utf8;
    for (const auto& [mark, encoding] :
         {std::pair<std::string_view, Encoding>{"\xEF\xBB\xBF", Encoding::utf8},
          {"\xFF\xFE", Encoding::utf16_little},
          {"\xFE\xFF", Encoding::utf16_big}}) {
      if (bytes.starts_with(mark)) {
        encoding_ = encoding;
        bytes.remove_prefix(mark.size());
        break;
      }
    }
  }
  if (encoding_ == Encoding::utf8) {
    block_ += bytes;
  } else {
    append_utf16(bytes);
  }
  if (block_.find('\0', kept) != block_.npos) {
    refuse(path_, "is no text; save the table as CSV in UTF-8; palpate.Recording takes arrays");
  }
}

void TextLines::append_utf16(std::string_view bytes) {
  left_ += bytes;
  const std::size_t high = encoding_ == Encoding::utf16_big ? 0 : 1;
  std::u16string units;
  for (std::size_t at = 0; at + 2 <= left_.size(); at += 2) {
    units += static_cast<char16_t>(static_cast<unsigned char>(left_[at + high]) << 8 |
                                   static_cast<unsigned char>(left_[at + 1 - high]));
  }
  using Utf = std::codecvt<char16_t, char8_t, std::mbstate_t>;
  std::u8string text(3 * units.size(), u8'\0');
  std::mbstate_t state{};
  const char16_t* read = units.data();
  char8_t* written = text.data();
  // Half of a pair of units is no character: U+FFFD stands for it, as a note may be cut anywhere.
  while (std::use_facet<Utf>(std::locale::classic())
             .out(state, read, units.data() + units.size(), read, written,
                  text.data() + text.size(), written) == Utf::error) {
    written = std::ranges::copy(std::u8string_view(u8"\uFFFD"), written).out;
    ++read;
  }
  block_.append(text.data(), written);
  left_.erase(0, 2 * static_cast<std::size_t>(read - units.data()));
}

CsvTable::CsvTable(std::filesystem::path path, std::optional<std::uint64_t> header_line)
    : path_(std::move(path)), lines_(path_), may_name_header_(header_line) {
  find_start(header_line.value_or(0));
  split();
  has_header_ = header_line.value_or(0) > 0 || is_header(cells_, separator_);
  name_columns();
  row_is_ready_ = !has_header_;
}

/// Goes on to the first line of the table.
void CsvTable::find_start(std::uint64_t header_line) {
  std::vector<std::string> lines;
  std::vector<std::uint64_t> numbers;
  std::optional<char> named;
  std::size_t bytes = 0;
  while (lines.size() < enough_lines && bytes < longest_line && next_line()) {
    if (const auto separator = separator_named(line_); separator && lines.empty()) {
      named = named ? named : separator;
      ++skipped_lines_;
    } else if (number_ >= header_line) {
      lines.emplace_back(line_);
      bytes += line_.size();
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
  constexpr std::size_t enough = 4;
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < std::min(enough, cells_.size()); ++i) {
    shown.push_back(fmt::format("'{}'", printable(cells_[i])));
  }
  header_words_ =
      fmt::format("{}{}", fmt::join(shown, ", "), cells_.size() > enough ? ", ..." : "");
  std::set<std::string> seen;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    columns_.push_back(has_header_ ? std::string(cells_[i]) : std::to_string(i + 1));
    const std::string& name = columns_.back();
    if (!name.empty() && !seen.insert(name).second) {
      refuse_columns("two columns are called '{}'; rename one", printable(name));
    }
  }
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

bool CsvTable::holds(std::size_t column, std::string_view value) const {
  const auto number = number_in(value, separator_);
  return cells_[column] == value || (number && number_in(cells_[column], separator_) == number);
}

bool CsvTable::is_kept() const {
  return std::ranges::all_of(kept_,
                             [&](const auto& where) { return holds(where.first, where.second); });
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
  if (cell.empty() || alike(cell, "nan")) {
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
  TextLines lines(path_);
  while (lines.next()) {
  }
  return lines.number();
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
