#pragma once

#include <functional>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

namespace palpate::bench {

/// What the commands measure: a document of records, which their tables, charts and pages show.
using Json = nlohmann::ordered_json;

/// Strings as they are, numbers in their shortest form, true and false as yes and no; lists of
/// numbers joined by "x", such as 64x64x244, other lists by "; ".
std::string plain_text(const Json& value);
/// A count such as 100, 17.5 k, 1 M or 1 G.
std::string count_text(double count);
/// Seconds with a unit and a prefix.
std::string seconds_text(double seconds);
/// "0.137 ± 0.011" of a record with `mean` and `standard_error`.
std::string mean_text(const Json& errors);
/// The same with the sign of the mean.
std::string difference_text(const Json& difference);

using Text = std::function<std::string(const Json& value)>;
/// Writes `factor` times a number by a format such as "{:.3f}".
Text number_text(const char* format, double factor = 1.0);

/// One field of a table's records.
struct Column {
  std::string head;
  std::string field;  ///< JSON pointer into a record
  Text text = plain_text;
};
using Columns = std::span<const Column>;

/// What a JSON pointer finds in a record, or null.
Json field_of(const Json& record, const std::string& field);
/// The texts of a record; `none` stands for null.
std::vector<std::string> texts_of(Columns columns, const Json& record, const std::string& none);

/// Print a Markdown table: its head, after an empty line, and its rows.
void print_head(Columns columns);
void print_row(Columns columns, const Json& record);
/// Nothing where there are no records.
void print_table(Columns columns, const Json& records);

}  // namespace palpate::bench
