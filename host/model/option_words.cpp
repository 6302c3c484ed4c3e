#include "model/option_words.hpp"

#include <algorithm>
#include <functional>
#include <regex>
#include <string>
#include <string_view>

namespace palpate {

namespace {

/// An option as it stands between backticks: "x-mm=-5:5".
struct NamedOption {
  std::string name;
  std::string separator;  ///< between name and value: "", " " or "="
  std::string value;
  bool heads;  ///< a colon follows: the message is about the option
};

/// The message with each option in the words of `say`; what stands between other backticks stays.
std::string with_options(std::string_view message,
                         const std::function<std::string(const NamedOption&)>& say) {
  static const std::regex option("`([a-z-]+)(?:([ =])([^`]*))?`");
  std::string text;
  std::string rest(message);
  for (std::smatch found; std::regex_search(rest, found, option); rest = found.suffix()) {
    text += found.prefix().str();
    text += say(
        {found[1].str(), found[2].str(), found[3].str(), found.suffix().str().starts_with(':')});
  }
  return text + rest;
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
    return "--" + option.name + option.separator + option.value;
  });
}

std::string in_keywords(std::string_view message) {
  return with_options(message, [](const NamedOption& option) {
    std::string text = option.name;
    std::ranges::replace(text, '-', '_');
    return option.heads && option.value.empty() ? text : text + "=" + python_value(option.value);
  });
}

}  // namespace palpate
