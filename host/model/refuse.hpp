#pragma once

#include <filesystem>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

/// Throws Error (Fault::input), "<source>: <message>"; the source is mostly a file, and the message
/// is formatted as by fmt::format().
template <typename... Parts>
[[noreturn]] void refuse(const std::filesystem::path& source,
                         fmt::format_string<const Parts&...> message, const Parts&... parts) {
  throw Error(Fault::input, fmt::format("{}: {}", source.string(), fmt::format(message, parts...)));
}

/// Throws Error (Fault::input), "<name> = <value>: <remedy>", unless it holds.
inline void require(bool sound, const char* name, double value, const char* remedy) {
  if (!sound) {
    throw Error(Fault::input, fmt::format("{} = {}: {}", name, value, remedy));
  }
}

}  // namespace palpate
