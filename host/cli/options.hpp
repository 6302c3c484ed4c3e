#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>
#include <glm/vec2.hpp>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "model/angle_unit.hpp"

namespace palpate::cli {

/// Adds a command whose flags are to fill the arguments, with which `run` is called.
template <typename Arguments, typename Run>
std::pair<CLI::App*, Arguments*> add_command(CLI::App& app, const char* name, const char* about,
                                             const Run& run) {
  CLI::App* command = app.add_subcommand(name, about);
  const auto arguments = std::make_shared<Arguments>();
  command->callback([arguments, run] { run(*arguments); });
  return {command, arguments.get()};
}

/// An option that must be given.
template <typename Value>
CLI::Option* add_required(CLI::App& command, const char* name, Value& value, const char* help) {
  return command.add_option(name, value, help)->required();
}
/// An option whose help shows its default.
template <typename Value>
CLI::Option* add_with_default(CLI::App& command, const char* name, Value& value, const char* help) {
  return command.add_option(name, value, help)->capture_default_str();
}

/// Says a sentence to the user, on standard error, its options as flags.
void tell_on_stderr(const std::string& sentence);

/// Throws Error, "<flag> <value>: <message>"; the message is formatted as by fmt::format().
template <typename Value, typename... Parts>
[[noreturn]] void refuse_flag(std::string_view flag, const Value& value,
                              fmt::format_string<const Parts&...> message, const Parts&... parts) {
  throw Error(Fault::input, fmt::format("{} {}: {}", flag, value, fmt::format(message, parts...)));
}

/// The value. Throws Error unless it is finite and above `least`, or `inclusive` and equal to it.
double require_above(const std::string& flag, double value, double least, bool inclusive = false);

/// For CLI11: what is wrong with the text of a whole number from 0, or "". CLI11 alone reads 010 as
/// octal, wraps -1 around and clamps numbers that are too large.
std::string require_whole_number(const std::string& text);

/// Writes a file that appears whole or not at all. Throws Error.
void write_file(const std::filesystem::path& file, std::string_view bytes,
                AtomicFile::Links links = AtomicFile::Links::followed);
/// Gives a result to its readers: as JSON to a file or, where it is "-", to standard output, unless
/// it is ""; and as text to standard output, unless the JSON stands there. Throws Error.
void give_result(const std::string& json_file, const std::string& json, const std::string& text);

/// An array as a table (CSV: x, y in mm) that palpate import takes as --array.
std::string array_table(std::span<const glm::dvec2> elements_mm);

}  // namespace palpate::cli
