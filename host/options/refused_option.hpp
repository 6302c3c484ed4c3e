#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

#include "options/option.hpp"
#include "palpate/error.hpp"

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

/// Throws Error about an option that the request has: "`<option> <value>`: <message>", or "<scene
/// file>: <key> = <value>: <message>" where that gave the option.
template <typename... Parts>
[[noreturn]] void refuse_given(const Request& request, std::string_view option,
                               fmt::format_string<const Parts&...> message, const Parts&... parts) {
  const std::string text = fmt::format(message, parts...);
  const std::string value = option_text(request, option_named(option));
  if (const auto key = request.keys.find(std::string(option)); key != request.keys.end()) {
    throw Error(Fault::input,
                fmt::format("{}: {} = {}: {}", request.scene, key->second, value, text));
  }
  refuse_option(option, value, "{}", text);
}

}  // namespace palpate
