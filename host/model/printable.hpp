#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace palpate {

namespace detail {

/// Length in bytes of the well-formed, printable character at the start of the text, or 0.
inline std::size_t character_length(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) {
    return lead >= 0x20 && lead != 0x7F ? 1 : 0;
  }
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC0 || lead > 0xF4 || text.size() < length) {
    return 0;
  }
  char32_t code = lead & (0x7Fu >> length);
  for (std::size_t k = 1; k < length; ++k) {
    const auto byte = static_cast<unsigned char>(text[k]);
    if ((byte & 0xC0) != 0x80) {
      return 0;
    }
    code = code << 6 | (byte & 0x3Fu);
  }
  constexpr char32_t smallest[] = {0, 0, 0xA0, 0x800, 0x10000};  // [length]; 0x80-0x9F are controls
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  const bool noncharacter = (code >= 0xFDD0 && code <= 0xFDEF) || (code & 0xFFFE) == 0xFFFE;
  return code >= smallest[length] && code <= 0x10FFFF && !surrogate && !noncharacter ? length : 0;
}

}  // namespace detail

/// The text with every control character and every byte that is not part of well-formed UTF-8
/// replaced by '?': Cairo draws nothing any more once it has met a malformed string, files refuse
/// it, and names of files and boards may hold any bytes.
inline std::string printable(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = detail::character_length(text);
    if (length == 0) {
      result += '?';
    } else {
      result += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return result;
}

/// True for text of which printable() replaces nothing: what may stand in a message, in JSON, on a
/// picture.
inline bool is_printable(std::string_view text) { return printable(text) == text; }

}  // namespace palpate
