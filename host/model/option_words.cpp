#include "model/option_words.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>

namespace palpate {

namespace {

constexpr std::string_view name_letters = "abcdefghijklmnopqrstuvwxyz-";

/// An option as it stands between backticks: "x-mm=-5:5".
struct NamedOption {
  std::string_view name;
  std::string_view separator;  ///< between name and value: "", " " or "="
  std::string_view value;
  bool heads;  ///< a colon follows: the message is about the option
};

/// The message with each option in the words of `say`; what stands between other backticks stays.
std::string with_options(std::string_view message,
                         const std::function<std::string(const NamedOption&)>& say) {
  // Not std::regex, whose stack grows with every character of a value.
  std::string text;
  while (!message.empty()) {
    const std::size_t begin = std::min(message.find('`'), message.size());
    text += message.substr(0, begin);
    message.remove_prefix(begin);
    const std::size_t end = message.find('`', 1);
    if (end == message.npos) {
      return text.append(message);
    }
    const std::string_view inside = message.substr(1, end - 1);
    const std::size_t name = std::min(inside.find_first_not_of(name_letters), inside.size());
    const std::string_view separator = inside.substr(name, 1);
    if (name == 0 || !(separator.empty() || separator == " " || separator == "=")) {
      text += '`';
      message.remove_prefix(1);
      continue;
    }
    message.remove_prefix(end + 1);
    text += say({inside.substr(0, name), separator, inside.substr(name + separator.size()),
                 message.starts_with(':')});
  }
  return text;
}

/// A value as Python writes it: 0.5, (25, 25, 16), 'auto'.
std::string python_value(std::string_view value) {
  if (!value.empty() && value.find_first_of("0123456789") == value.npos) {
    return "'" + std::string(value) + "'";
  }
  std::string numbers;
  bool several = false;
  for (const char c : value) {
    const bool separates = c == 'x' || c == ':' || c == ',';
    if (!separates && std::string_view("0123456789.+-e").find(c) == value.npos) {
      return "'" + std::string(value) + "'";
    }
    several = several || separates;
    numbers += separates ? std::string(", ") : std::string(1, c);
  }
  return several ? "(" + numbers + ")" : numbers;
}

}  // namespace

std::string in_flags(std::string_view message) {
  return with_options(message, [](const NamedOption& option) {
    return std::string("--").append(option.name).append(option.separator).append(option.value);
  });
}

std::string in_keywords(std::string_view message) {
  return with_options(message, [](const NamedOption& option) {
    std::string text(option.name);
    std::ranges::replace(text, '-', '_');
    return option.heads && option.value.empty() ? text : text + "=" + python_value(option.value);
  });
}

}  // namespace palpate
