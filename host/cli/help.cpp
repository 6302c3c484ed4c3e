#include "cli/help.hpp"

#include <algorithm>
#include <memory>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace palpate::cli {

namespace {

/// Flags by what they are for; the others stand under "Options".
struct Group {
  const char* name;
  std::vector<const char*> flags;
};
const std::vector<Group>& groups() {
  static const std::vector<Group> all{
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
  return all;
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

}  // namespace

void arrange_help(CLI::App& app) {
  const auto help = std::make_shared<Help>();
  help->column_width(26);
  app.formatter(help);
  for (CLI::App* command : app.get_subcommands({})) {
    command->formatter(help);
    for (const Group& group : groups()) {
      for (const char* flag : group.flags) {
        CLI::Option* option = command->get_option_no_throw(flag);
        if (option != nullptr && option->get_group() == "Options") {
          option->group(group.name);
        }
      }
    }
  }
}

}  // namespace palpate::cli
