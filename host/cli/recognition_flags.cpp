#include "cli/recognition_flags.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "options/option.hpp"

namespace palpate::cli {

void add_option_flag(CLI::App& command, Request& request, std::string_view name,
                     const std::string& help) {
  const Option& option = option_named(name);
  const std::string flag = fmt::format("--{}", name);
  const std::string about = help.empty() ? option.help : help;
  CLI::Option* added = nullptr;
  if (const auto* member = std::get_if<bool Request::*>(&option.member)) {
    added = command.add_flag(flag, request.**member, about);
  } else {
    added = command.add_option_function<std::string>(
        flag,
        [&request, &option, flag](const std::string& text) {
          if (const std::string remedy = set_option(request, option, text); !remedy.empty()) {
            refuse_flag(flag, text, "{}", remedy);
          }
        },
        about);
  }
  if (std::holds_alternative<std::optional<NoneWeight> Request::*>(option.member)) {
    added->type_name("W")->expected(0, 1)->default_str("auto");
  } else if (std::holds_alternative<std::optional<double> Request::*>(option.member)) {
    added->type_name("FLOAT");
  } else if (std::holds_alternative<std::optional<int> Request::*>(option.member) ||
             std::holds_alternative<std::optional<std::uint64_t> Request::*>(option.member)) {
    added->type_name("INT");
  }
  added->group(option.group);
}

void add_recognition_flags(CLI::App& command, Request& request, bool& verbose) {
  command.add_option("--maps", request.maps, "Maps of the known objects, or folders of maps");
  for (const Option& option : options()) {
    if (!option.of_selection) {
      add_option_flag(command, request, option.name);
    }
  }
  command.add_flag("--verbose", verbose,
                   "Say on standard error how the filter works: its device and memory, the kernels "
                   "of the likelihood, the lattice, the seconds it took");
}

void add_selection_flags(CLI::App& command, Request& request) {
  for (const Option& option : options()) {
    if (option.of_selection) {
      add_option_flag(command, request, option.name);
    }
  }
}

Recogniser open_telling(const RecognitionJob& job, const std::function<void()>& cancel_point) {
  Recogniser recogniser = job.open({.cancel_point = cancel_point});
  std::ranges::for_each(job.task().remarks, tell_on_stderr);
  return recogniser;
}

void add_recognition_files(const Request& request, CommandFiles& files) {
  for (const auto& [option, file] : files_of(request)) {
    files.reads("--" + option, file);
  }
}

}  // namespace palpate::cli
