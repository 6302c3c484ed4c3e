#include "table.hpp"

#include <algorithm>
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

}  // namespace palpate::bench
