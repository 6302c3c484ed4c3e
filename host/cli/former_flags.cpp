#include "cli/former_flags.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace palpate::cli {

namespace {

constexpr std::array table{
    FormerFlag{"", "--help-all", "give --help, which explains every flag"},
    FormerFlag{"", "--memory-mib",
               "give --filter bounded, which needs no memory of the device, or fewer --bins"},
    FormerFlag{"batch", "--update",
               "give -o a new folder where recordings, maps or flags have changed"},
    FormerFlag{"calibrate", "--png",
               "draw it in Python, by palpate.calibrate(...).after.plot() and .sensor.plot()"},
    FormerFlag{"check", "--psf-mm", "give --spread-mm, half of it"},
    FormerFlag{"evaluate", "--png", "draw it in Python, by palpate.evaluate(RESULTS).plot()"},
    FormerFlag{"map", "--psf-mm", "give --spread-mm, half of it"},
    FormerFlag{"plan", "--png", "read the table, or give --json"},
    FormerFlag{"recognize", "--fit-touch-sd",
               "give --touch-sd-mm, as docs/misplaced.md measures it"},
    FormerFlag{"touches", "--tare",
               "leave it out: the rest of each element is found in the whole recording"},
};

}  // namespace

std::span<const FormerFlag> former_flags() { return table; }

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
    const auto known = std::ranges::find_if(table, [&](const FormerFlag& flag) {
      return flag.name == name && (flag.command.empty() || flag.command == command);
    });
    if (known != table.end()) {
      return fmt::format("'{}' is no flag of palpate {}; {}", argument, command, known->remedy);
    }
  }
  return {};
}

}  // namespace palpate::cli
