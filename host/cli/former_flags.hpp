#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace palpate::cli {

/// A flag that a command has lost.
struct FormerFlag {
  std::string_view command;  ///< "": any
  std::string_view name;     ///< with its dashes
  std::string_view remedy;   ///< what to do instead, as a clause that begins with a verb
};

std::span<const FormerFlag> former_flags();

/// Answers the first former flag among the program's arguments, which begin with the command; none
/// where there is no such flag.
std::optional<std::string> answer_to_former_flag(std::span<const char* const> arguments);

}  // namespace palpate::cli
