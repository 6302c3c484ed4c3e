#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/supervisor.hpp"
#include "model/option_words.hpp"
#include "palpate/error.hpp"

namespace palpate::cli {

namespace {

/// Opens /dev/null in place of closed standard streams. Otherwise the first files opened would take
/// their numbers, and what is printed would go into them. To be called before anything else.
void open_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // open() takes the lowest free number, which is this stream's.
    if (::fcntl(stream, F_GETFD) == -1 && ::open("/dev/null", O_RDWR) < 0) {
      return;
    }
  }
}

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

/// A flag that a command has lost.
struct FormerFlag {
  std::string_view command;  ///< "": any
  std::string_view name;     ///< with its dashes
  std::string_view remedy;   ///< what to do instead, as a clause that begins with a verb
};

constexpr std::string_view no_device_memory =
    "give --filter bounded, which needs no memory of the device, or fewer --bins";

constexpr FormerFlag former_flags[] = {
    {"", "--help-all", "give --help, which explains every flag"},
    {"batch", "--memory-mib", no_device_memory},
    {"live", "--memory-mib", no_device_memory},
    {"plan", "--memory-mib", no_device_memory},
    {"recognize", "--memory-mib", no_device_memory},
    {"batch", "--update", "give -o a new folder where recordings, maps or flags have changed"},
    {"calibrate", "--png",
     "draw it in Python, by palpate.calibrate(...).after.plot() and .sensor.plot()"},
    {"check", "--psf-mm", "give --spread-mm, half of it"},
    {"evaluate", "--png", "draw it in Python, by palpate.evaluate(RESULTS).plot()"},
    {"map", "--psf-mm", "give --spread-mm, half of it"},
    {"plan", "--png", "read the table, or give --json"},
    {"recognize", "--fit-touch-sd", "give --touch-sd-mm, as docs/misplaced.md measures it"},
    {"touches", "--tare", "leave it out: the rest of each element is found in the whole recording"},
};

/// Answers the first former flag among the program's arguments, which begin with the command; none
/// where there is no such flag.
std::optional<std::string> answer_to_former_flag(std::span<const char* const> arguments) {
  if (arguments.empty()) {
    return {};
  }
  const std::string_view command = arguments.front();
  for (const std::string_view argument : arguments.subspan(1)) {
    if (argument == "--") {
      break;  // what follows are files
    }
    const std::string_view name = argument.substr(0, argument.find('='));
    const auto known = std::ranges::find_if(former_flags, [&](const FormerFlag& flag) {
      return flag.name == name && (flag.command.empty() || flag.command == command);
    });
    if (known != std::end(former_flags)) {
      return fmt::format("'{}' is no flag of palpate {}; {}", argument, command, known->remedy);
    }
  }
  return {};
}

/// CLI11's help; the list of commands has the first sentence of each.
class Help : public CLI::Formatter {
 public:
  std::string make_subcommand(const CLI::App* command) const override {
    const std::string about = command->get_description();
    return fmt::format("  {:<11} {}\n", command->get_name(),
                       about.substr(0, std::min(about.find(". "), about.find("; "))));
  }
};

/// Groups the flags in the help of every command by what they are for; the others stand under
/// "Options".
void arrange_help(CLI::App& app) {
  const std::pair<const char*, std::vector<const char*>> groups[] = {
      {"Likelihood", {"--prior", "--gamma", "--ratio", "--spread-mm", "--peak", "--felt-share"}},
      {"Misplaced touches and slip", {"--touch-sd-mm", "--touch-sd-deg"}},
      {"Device", {"--device", "--verbose"}},
      {"Touches in a stream",
       {"--onset", "--release", "--steady", "--min-steady-s", "--smooth-s", "--drift-s", "--tare",
        "--reset-after", "--slide"}},
      {"Columns and times of tables",
       {"--rows", "--header-line", "--where", "--split", "--pressure-columns",
        "--pressure-component", "--pose-columns", "--euler", "--matrix", "--mount", "--pose-unit",
        "--time-unit", "--time-column", "--plane", "--largest-gap-s", "--pose-delay", "--rate"}},
      {"Of --sensor -", {}},  // as the command groups them
      {"Work", {"--chunk", "--threads"}},
      {"Samples of the belief", {"--samples", "--plan-seed"}},
  };
  const auto help = std::make_shared<Help>();
  help->column_width(26);
  app.formatter(help);
  for (CLI::App* command : app.get_subcommands({})) {
    command->formatter(help);
    for (const auto& [group, flags] : groups) {
      for (const char* flag : flags) {
        CLI::Option* option = command->get_option_no_throw(flag);
        if (option != nullptr && option->get_group() == "Options") {
          option->group(group);
        }
      }
    }
  }
}

// The exit status that other programs rely on.
constexpr int wrong_input = 2;
constexpr int failed = 1;

/// Prints the message as one line, without control characters, its options as flags, and returns
/// the status.
int complain(int status, std::string message) {
  message = in_flags(message);
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
  return complain(
      failed,
      "out of memory; end other programs, or use smaller files, fewer bins, objects or cells");
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

int run(int argc, char** argv) {
  const std::span<const char* const> arguments(argv, static_cast<std::size_t>(argc));
  if (const auto answer = answer_to_former_flag(arguments.subspan(argc > 0 ? 1 : 0))) {
    return complain(wrong_input, *answer);
  }
  CLI::App app("Palpate recognises objects by touch and finds their poses.", "palpate");
  app.set_version_flag("--version", PALPATE_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
  for (const auto& add : {add_devices, add_sensors, add_record, add_import, add_touches, add_live,
                          add_simulate, add_map, add_check, add_calibrate, add_recognize, add_batch,
                          add_merge, add_plan, add_evaluate, add_info, add_view, add_export}) {
    add(app);
  }
  refuse_empty_values(app);
  arrange_help(app);
  int status = 0;
  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {  // of a command that was done
    status = error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      app.exit(error);  // prints --help or --version
      std::cout.flush();
      return finish();
    }
    const auto commands = app.get_subcommands();
    const std::string command = commands.empty() ? "" : commands.front()->get_name();
    const std::string see =
        fmt::format("; see palpate {}{}--help", command, command.empty() ? "" : " ");
    const auto unexpected = app.remaining(true);
    const bool unknown = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
    const bool flag = !unexpected.empty() && unexpected.front().starts_with('-');
    if (!unexpected.empty() && (command.empty() || unknown || flag)) {
      return complain(wrong_input, fmt::format("'{}' is {}{}", unexpected.front(),
                                               command.empty() ? "no command or flag"
                                               : flag          ? "no flag of palpate " + command
                                                               : "one argument too many",
                                               see));
    }
    const bool number = error.get_name() == "ConversionError";  // all values but texts are numbers
    return complain(wrong_input, error.what() + std::string(number ? ": give a number" : "") + see);
  }
  const int finished = finish();
  return finished != 0 ? finished : status;
}

/// Runs the program in a process that another one watches. Returns the exit status.
int run_supervised(int argc, char** argv) {
  try {
    // A batch has a record for a file that cannot be read, and a page of files stays.
    const std::string_view command = argc > 1 ? argv[1] : "";
    supervise(command == "batch" || command == "view" ? Restart::without_the_file : Restart::never);
    use_bundled_fonts();
    return run(argc, argv);
  } catch (const Error& error) {
    return complain(error.fault() == Fault::input ? wrong_input : failed, error.what());
  } catch (const std::bad_alloc&) {
    return complain_of_memory();
  } catch (const std::length_error&) {  // more than any memory
    return complain_of_memory();
  } catch (const std::exception& error) {
    // fmt::print throws where standard output cannot be written, without naming it.
    return std::ferror(stdout) != 0 ? complain_of_output() : complain(failed, error.what());
  }
}

}  // namespace

int run_program(int argc, char** argv) {
  open_closed_streams();
  return run_supervised(argc, argv);
}

}  // namespace palpate::cli
