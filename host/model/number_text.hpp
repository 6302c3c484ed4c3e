#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace palpate {

// Numbers in files and on command lines, such as -1.5, +2 or 1e-3, are read independently of the
// locale: an embedding program that shows its users decimal commas must not change what a file
// says.

namespace detail {

/// Reads all of the text, after a plus sign if it has one, as std::from_chars() does.
template <class Number, class... Base>
std::optional<Number> all_of(std::string_view text, Base... base) {
  const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
  text.remove_prefix(plus ? 1 : 0);
  Number number{};
  const char* text_end = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), text_end, number, base...);
  return error == std::errc{} && end == text_end ? std::optional(number) : std::nullopt;
}

}  // namespace detail

/// The parts of the text between separators, also empty ones.
inline std::vector<std::string_view> split_text(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t end = 0; end != text.npos; text.remove_prefix(std::min(end + 1, text.size()))) {
    end = text.find(separator);
    parts.push_back(text.substr(0, end));
  }
  return parts;
}

/// Returns the text as a finite number; none where it is not one as a whole.
inline std::optional<double> number_of(std::string_view text) {
  const std::optional<double> number = detail::all_of<double>(text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

/// The whole number, decimal unless another base is given, that all of the text is, if it is one:
/// "010" is 10.
inline std::optional<std::int64_t> whole_number_of(std::string_view text, int base = 10) {
  return detail::all_of<std::int64_t>(text, base);
}

/// Returns the line as two finite numbers separated by blanks; none where it is anything else.
inline std::optional<std::array<double, 2>> two_numbers_of(std::string_view line) {
  constexpr std::string_view blanks = " \t\r\v\f";
  std::array<double, 2> numbers{};
  for (double& number : numbers) {
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    const std::string_view word = line.substr(0, line.find_first_of(blanks));
    const std::optional<double> value = number_of(word);
    if (!value) {
      return {};
    }
    number = *value;
    line.remove_prefix(word.size());
  }
  const bool all = line.find_first_not_of(blanks) == std::string_view::npos;
  return all ? std::optional(numbers) : std::nullopt;
}

}  // namespace palpate
