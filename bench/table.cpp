#include "table.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>

#include <fmt/format.h>

namespace palpate::bench {

std::string plain_text(const Json& value) {
  if (value.is_string()) {
    return value.get<std::string>();
  }
  if (value.is_boolean()) {
    return value.get<bool>() ? "yes" : "no";
  }
  if (value.is_array()) {
    std::vector<std::string> texts;
    std::transform(value.begin(), value.end(), std::back_inserter(texts), plain_text);
    const bool numbers = !value.empty() && value.front().is_number();
    return fmt::format("{}", fmt::join(texts, numbers ? "x" : "; "));
  }
  return value.is_number_float() ? fmt::format("{}", value.get<double>()) : value.dump();
}

std::string count_text(double count) {
  return count >= 0.9995e9   ? fmt::format("{:.3g} G", count / 1e9)
         : count >= 0.9995e6 ? fmt::format("{:.3g} M", count / 1e6)
         : count >= 0.9995e3 ? fmt::format("{:.3g} k", count / 1e3)
                             : fmt::format("{:.3g}", count);
}

std::string seconds_text(double seconds) {
  return seconds >= 0.9995      ? fmt::format("{:.3g} s", seconds)
         : seconds >= 0.9995e-3 ? fmt::format("{:.3g} ms", 1e3 * seconds)
                                : fmt::format("{:.3g} us", 1e6 * seconds);
}

std::string mean_text(const Json& errors) {
  return fmt::format("{:.3f} ± {:.3f}", errors.at("mean").get<double>(),
                     errors.at("standard_error").get<double>());
}

std::string difference_text(const Json& difference) {
  return fmt::format("{:+.3f} ± {:.3f}", difference.at("mean").get<double>(),
                     difference.at("standard_error").get<double>());
}

Text number_text(const char* format, double factor) {
  return [=](const Json& value) {
    return fmt::format(fmt::runtime(format), factor * value.get<double>());
  };
}

Json field_of(const Json& record, const std::string& field) {
  const Json::json_pointer pointer(field);
  return record.contains(pointer) ? record.at(pointer) : Json(nullptr);
}

std::vector<std::string> texts_of(Columns columns, const Json& record, const std::string& none) {
  std::vector<std::string> texts;
  for (const Column& column : columns) {
    const Json value = field_of(record, column.field);
    texts.push_back(value.is_null() ? none : column.text(value));
  }
  return texts;
}

void print_head(Columns columns) {
  std::string heads;
  std::string ruler;
  for (const Column& column : columns) {
    heads += "| " + column.head + " ";
    ruler += ruler.empty() ? "|:--|" : "--:|";
  }
  fmt::print("\n{}|\n{}\n", heads, ruler);
}

void print_row(Columns columns, const Json& record) {
  fmt::print("| {} |\n", fmt::join(texts_of(columns, record, "–"), " | "));
  std::fflush(stdout);
}

void print_table(Columns columns, const Json& records) {
  if (!records.empty()) {
    print_head(columns);
  }
  for (const Json& record : records) {
    print_row(columns, record);
  }
}

}  // namespace palpate::bench
