#pragma once

#include <filesystem>
#include <optional>
#include <string>

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

/// What is wrong with the input that `work` takes, by its Error (Fault::input); none where it
/// throws none. What else it throws is thrown.
template <typename Work>
std::optional<std::string> input_fault_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    if (error.fault() != Fault::input) {
      throw;
    }
    return error.what();
  }
  return {};
}

/// Throws Error (Fault::input), "<name> = <value>: <remedy>", unless it holds.
inline void require(bool sound, const char* name, double value, const char* remedy) {
  if (!sound) {
    throw Error(Fault::input, fmt::format("{} = {}: {}", name, value, remedy));
  }
}

}  // namespace palpate
