#include "io/csv_table.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <set>

#include "model/number_text.hpp"
#include "model/printable.hpp"

namespace palpate {

namespace {

constexpr std::size_t block_bytes = 1 << 20;
// A row of 100,000 numbers is shorter; a file without line ends must not fill the memory.
constexpr std::size_t longest_line = 16 << 20;
constexpr std::string_view blanks = " \t\r\v\f";
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

bool is_unknown(std::string_view cell) { return cell.empty() || alike(cell, "nan"); }

/// Index of the quote that ends the text in quotes from `begin` on; npos where none does.
std::size_t closing_quote(std::string_view line, std::size_t begin) {
  std::size_t at = line.find('"', begin + 1);
  while (at != line.npos && at + 1 < line.size() && line[at + 1] == '"') {
    at = line.find('"', at + 2);  // a doubled quote stands for itself
  }
  return at;
}

/// The line up to its comment.
std::string_view without_comment(std::string_view line) {
  if (line.find('#') == line.npos) {
    return line;
  }
  for (std::size_t at = 0; at < line.size(); ++at) {
    if (line[at] == '"') {
      at = std::min(closing_quote(line, at), line.size());
    } else if (line[at] == '#' && (at == 0 || blanks.find(line[at - 1]) != blanks.npos)) {
      return line.substr(0, at);
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
      return separator;
    }
  }
  return ' ';
}

std::optional<double> number_in(std::string_view cell, char separator) {
  if (separator == ',' || cell.find(',') == cell.npos) {
    return number_of(cell);
  }
  std::string with_point(cell);
  std::ranges::replace(with_point, ',', '.');
  return number_of(with_point);
}

/// True for the text of a number, finite or not: 1, -2.5, inf, nan, 1e999.
bool is_numeric(std::string_view cell, char separator) {
  std::string text(cell.substr(cell.starts_with('+') ? 1 : 0));
  if (separator != ',') {
    std::ranges::replace(text, ',', '.');
  }
  double number = 0.0;
  const char* const end = text.data() + text.size();
  return !text.empty() && std::from_chars(text.data(), end, number).ptr == end;
}

}  // namespace

bool alike(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

CsvTable::CsvTable(std::filesystem::path path) : path_(std::move(path)) {
  require_readable(path_);
  file_ = Descriptor(path_, O_RDONLY);
  if (!next_line()) {
    palpate::refuse(path_, "holds no row; write at least one");
  }
  separator_ = separator_of(line_);
  split(line_);
  has_header_ = is_header();
  name_columns();
  row_is_ready_ = !has_header_;
}

bool CsvTable::is_header() const {
  bool counts = true;
  std::size_t numbers = 0;
  std::size_t names = 0;
  for (const std::string_view cell : cells_) {
    if (is_numeric(cell, separator_)) {
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

void CsvTable::name_columns() {
  if (has_header_ && cells_.size() > 1 && cells_.back().empty()) {
    cells_.pop_back();  // a separator ends each row
  }
  std::set<std::string> seen;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    columns_.push_back(has_header_ ? std::string(cells_[i]) : std::to_string(i + 1));
    const std::string& name = columns_.back();
    if (!name.empty() && !seen.insert(name).second) {
      refuse("two columns are called '{}'; rename one", printable(name));
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

bool CsvTable::next() {
  if (row_is_ready_) {
    row_is_ready_ = false;
    row_is_first_ = true;
    return true;
  }
  row_is_first_ = false;
  if (!next_line()) {
    return false;
  }
  split(line_);
  if (cells_.size() == columns_.size() + 1 && cells_.back().empty()) {
    cells_.pop_back();
  }
  if (cells_.size() != columns_.size()) {
    refuse("the row has {} cells, the first row {}; write the same columns in every row",
           cells_.size(), columns_.size());
  }
  return true;
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

/// Finds the next line that holds a row: line_, without its comment.
bool CsvTable::next_line() {
  for (;;) {
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
    ++line_number_;
    if (line_number_ == 1 && line_.starts_with(byte_order_mark)) {
      line_.remove_prefix(byte_order_mark.size());
    }
    line_ = without_comment(line_);
    if (line_.find_first_not_of(blanks) != line_.npos) {
      return true;
    }
  }
}

void CsvTable::read_block() {
  block_.erase(0, begin_);
  begin_ = 0;
  const std::size_t kept = block_.size();
  if (kept > longest_line) {
    palpate::refuse(path_, "line {} is longer than 16 MB: this is no table; give one row a line",
                    line_number_ + 1);
  }
  block_.resize(kept + block_bytes);
  const ssize_t got = ::read(file_.get(), block_.data() + kept, block_bytes);
  if (got < 0) {
    palpate::refuse(path_, "cannot be read: {}; copy or record it again", std::strerror(errno));
  }
  block_.resize(kept + static_cast<std::size_t>(got));
  at_end_ = got == 0;
  if (block_.find('\0', kept) != block_.npos) {
    palpate::refuse(path_,
                    "is no text; save the table as CSV in UTF-8; palpate.Recording takes arrays");
  }
}

void CsvTable::split(std::string_view line) {
  cells_.clear();
  if (separator_ == ' ') {
    line = trimmed(line);
  }
  for (std::size_t at = 0;;) {
    const std::size_t begin = line.find_first_not_of(separator_ == '\t' ? " \r" : blanks, at);
    if (begin != line.npos && line[begin] == '"') {
      const std::size_t quote = closing_quote(line, begin);
      if (quote == line.npos) {
        refuse("a quote is not closed; close it in the line in which it opens");
      }
      cells_.push_back(trimmed(line.substr(begin + 1, quote - begin - 1)));
      at = quote + 1;
      if (separator_ != ' ' && !trimmed(line.substr(at, line.find(separator_, at) - at)).empty()) {
        refuse("text follows a closing quote; put the whole cell in quotes");
      }
      at = separator_ == ' ' ? at : line.find(separator_, at);
    } else {
      const std::size_t start = separator_ == ' ' ? begin : at;
      const std::size_t end =
          separator_ == ' ' ? line.find_first_of(blanks, start) : line.find(separator_, start);
      cells_.push_back(trimmed(line.substr(start, end - start)));
      at = end;
    }
    if (at >= line.size()) {
      return;  // npos too
    }
    ++at;
    if (separator_ == ' ' && line.find_first_not_of(blanks, at) == line.npos) {
      return;
    }
  }
}

std::string CsvTable::place() const { return fmt::format("{}:{}", path_.string(), line_number_); }

}  // namespace palpate
