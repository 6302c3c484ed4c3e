#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/former_flags.hpp"
#include "cli/help.hpp"
#include "cli/supervisor.hpp"
#include "model/descriptor.hpp"
#include "model/option_words.hpp"
#include "palpate/error.hpp"

namespace {

/// Has pictures drawn with the fonts that lie beside the program, in ../share/palpate/fonts, as in
/// a Python wheel: the machine may have neither fonts nor a configuration of fontconfig. Without
/// such a folder, and where FONTCONFIG_FILE is set in the environment, fontconfig finds the font.
void use_bundled_fonts() {
  std::error_code code;
  const auto program = std::filesystem::canonical("/proc/self/exe", code);
  const auto fonts = program.parent_path().parent_path() / "share" / "palpate" / "fonts";
  if (!std::filesystem::is_directory(fonts, code) || std::getenv("FONTCONFIG_FILE") != nullptr) {
    return;
  }
  // Fonts of an application, one file after another: with a folder, fontconfig would write a cache,
  // and complain on standard error where it must not.
  FcConfig* config = FcConfigCreate();
  for (const char* font : {"DejaVuSans.ttf", "DejaVuSans-Bold.ttf"}) {
    const std::string file = fonts / font;
    FcConfigAppFontAddFile(config, reinterpret_cast<const FcChar8*>(file.c_str()));
  }
  FcConfigSetCurrent(config);
}

// The exit status that other programs rely on.
constexpr int wrong_input = 2;
constexpr int failed = 1;

/// Prints the message as one line, without control characters, its options as flags, and returns
/// the status.
int complain(int status, std::string message) {
  message = palpate::in_flags(message);
  std::replace_if(
      message.begin(), message.end(), [](unsigned char c) { return c < ' '; }, ' ');
  // Not fmt::print, which throws where standard error cannot be written.
  std::fprintf(stderr, "palpate: %s\n", message.c_str());
  return status;
}

int complain_of_output() {
  return complain(failed,
                  "standard output: cannot be written; free disk space, or read it to its end");
}

int complain_of_memory() {
  return complain(failed,
                  "out of memory; end other programs, or use smaller files, fewer bins, objects or "
                  "cells");
}

/// The exit status after a command has succeeded: 0, or 1 where a part of its output was lost.
int finish() {
  return std::fflush(stdout) != 0 || std::ferror(stdout) != 0 ? complain_of_output() : 0;
}

/// CLI11 would take the default for an empty value, such as a script's unset variable.
void refuse_empty_values(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands({})) {
    for (CLI::Option* option : command->get_options()) {
      option->check([](const std::string& value) {
        return value.empty() ? "the value is empty; give a value or leave the flag out" : "";
      });
    }
  }
}

/// A batch has a record for a file that cannot be read, and a page of files stays.
palpate::cli::Restart restart_of(std::string_view command) {
  return command == "batch" || command == "view" ? palpate::cli::Restart::without_the_file
                                                 : palpate::cli::Restart::never;
}

int run(int argc, char** argv) {
  const std::span<const char* const> arguments(argv, static_cast<std::size_t>(argc));
  if (const auto answer =
          palpate::cli::answer_to_former_flag(arguments.subspan(argc > 0 ? 1 : 0))) {
    return complain(wrong_input, *answer);
  }
  CLI::App app("Palpate recognises objects by touch and finds their poses, on Vulkan.", "palpate");
  app.set_version_flag("--version", PALPATE_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
  palpate::cli::add_devices(app);
  palpate::cli::add_sensors(app);
  palpate::cli::add_record(app);
  palpate::cli::add_import(app);
  palpate::cli::add_touches(app);
  palpate::cli::add_live(app);
  palpate::cli::add_simulate(app);
  palpate::cli::add_map(app);
  palpate::cli::add_check(app);
  palpate::cli::add_calibrate(app);
  palpate::cli::add_recognize(app);
  int status = 0;
  palpate::cli::add_batch(app, status);
  palpate::cli::add_merge(app);
  palpate::cli::add_plan(app);
  palpate::cli::add_evaluate(app);
  palpate::cli::add_info(app);
  palpate::cli::add_view(app);
  palpate::cli::add_export(app);
  refuse_empty_values(app);
  palpate::cli::arrange_help(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      app.exit(error);  // prints --help or --version
      std::cout.flush();
      return finish();
    }
    const auto commands = app.get_subcommands();
    const CLI::App* command = commands.empty() ? nullptr : commands.front();
    const auto unexpected = app.remaining(true);
    const bool unknown = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
    const bool flag = !unexpected.empty() && unexpected.front().starts_with('-');
    if (!unexpected.empty() && (command == nullptr || unknown || flag)) {
      const std::string& typed = unexpected.front();
      return complain(wrong_input,
                      fmt::format("'{}' is {}; see palpate {}--help", typed,
                                  command == nullptr ? "no command or flag"
                                  : flag             ? "no flag of palpate " + command->get_name()
                                                     : "one argument too many",
                                  command == nullptr ? "" : command->get_name() + " "));
    }
    const bool number = error.get_name() == "ConversionError";  // all values but texts are numbers
    return complain(wrong_input, fmt::format("{}{}; see palpate {}--help", error.what(),
                                             number ? ": give a number" : "",
                                             command == nullptr ? "" : command->get_name() + " "));
  }
  const int finished = finish();
  return finished != 0 ? finished : status;
}

}  // namespace

int main(int argc, char** argv) {
  palpate::open_closed_streams();
  try {
    palpate::cli::supervise(restart_of(argc > 1 ? argv[1] : ""));
    use_bundled_fonts();
    return run(argc, argv);
  } catch (const palpate::Error& error) {
    return complain(error.fault() == palpate::Fault::input ? wrong_input : failed, error.what());
  } catch (const std::bad_alloc&) {
    return complain_of_memory();
  } catch (const std::length_error&) {  // more than any memory
    return complain_of_memory();
  } catch (const std::exception& error) {
    // fmt::print throws where standard output cannot be written, without naming it.
    return std::ferror(stdout) != 0 ? complain_of_output() : complain(failed, error.what());
  }
}
