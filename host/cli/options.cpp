#include "cli/options.hpp"

#include <charconv>
#include <cmath>
#include <system_error>

#include "model/option_words.hpp"

namespace palpate::cli {

void tell_on_stderr(const std::string& sentence) {
  fmt::print(stderr, "palpate: {}\n", in_flags(sentence));
}

double require_above(const std::string& flag, double value, double least, bool inclusive) {
  if (!std::isfinite(value) || value < least || (!inclusive && value == least)) {
    refuse_flag(flag, value, "must be {} {}", inclusive ? "at least" : "above", least);
  }
  return value;
}

std::string require_whole_number(const std::string& text) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  const bool octal = text.size() > 1 && text.front() == '0';
  return error == std::errc{} && rest == end && !octal
             ? ""
             : fmt::format("{}: give a whole number, such as 10", text);
}

void write_file(const std::filesystem::path& file, std::string_view bytes,
                AtomicFile::Links links) {
  AtomicFile target(file, links);
  target.write(bytes);
  target.commit();
}

void give_result(const std::string& json_file, const std::string& json, const std::string& text) {
  // The file comes first: printing fails where the reader of standard output has ended.
  if (!json_file.empty() && json_file != "-") {
    write_file(json_file, json);
  }
  fmt::print("{}", json_file == "-" ? json : text);
}

std::string array_table(std::span<const glm::dvec2> elements_mm) {
  std::string text = "x,y\n";
  for (const glm::dvec2& p : elements_mm) {
    text += fmt::format("{},{}\n", p.x, p.y);
  }
  return text;
}

}  // namespace palpate::cli
