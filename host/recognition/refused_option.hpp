#pragma once

#include <string>
#include <string_view>

#include "io/input_file.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// Throws Error, "`<option> <value>`: <message>"; the message is formatted as by fmt::format().
template <typename Value, typename... Parts>
[[noreturn]] void refuse_option(std::string_view option, const Value& value,
                                fmt::format_string<const Parts&...> message,
                                const Parts&... parts) {
  throw Error(Fault::input,
              fmt::format("`{} {}`: {}", option, value, fmt::format(message, parts...)));
}

/// Throws Error, "`<option>`: <message>".
[[noreturn]] inline void refuse_option(std::string_view option, std::string_view message) {
  throw Error(Fault::input, fmt::format("`{}`: {}", option, message));
}

/// Throws Error as above, or "<scene file>: <key>: <message>" where that gave the option.
template <typename... Parts>
[[noreturn]] void refuse_given(const Request& request, const std::string& option,
                               fmt::format_string<const Parts&...> message, const Parts&... parts) {
  const std::string text = fmt::format(message, parts...);
  if (const auto key = request.keys.find(option); key != request.keys.end()) {
    refuse(request.scene, "{}: {}", key->second, text);
  }
  refuse_option(option, text);
}

}  // namespace palpate
