#pragma once

#include <string>

namespace CLI {
class App;
}

namespace palpate::cli {

/// Arranges what --help prints of every command: the flags that most uses need, in their first
/// sentences, and the names of the others by what they are for; --help-all explains them all. Lines
/// are wrapped to a terminal. To be called once all commands are there.
void arrange_help(CLI::App& app);

/// The command or flag of the program that a mistyped one is nearest to, as "; did you mean X?"; ""
/// where none is near.
/// @param command whose flags are meant; the program's own commands where it is null
std::string suggestion(const CLI::App& app, const CLI::App* command, const std::string& typed);

}  // namespace palpate::cli
