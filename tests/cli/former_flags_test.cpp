// What the program says to a flag that a command has lost.

#include "cli/former_flags.hpp"

#include <regex>

#include "support/program.hpp"

namespace palpate::former_flags_test {

using FormerFlags = ProgramTest;

std::string command_of(const cli::FormerFlag& flag) {
  return flag.command.empty() ? "recognize" : std::string(flag.command);
}

TEST_F(FormerFlags, AreAnsweredWithWhatToUseInstead) {
  EXPECT_EQ(cli::answer_to_former_flag({}), std::nullopt);
  for (const cli::FormerFlag& flag : cli::former_flags()) {
    const std::string name(flag.name);
    const std::string command = command_of(flag);
    const std::string words = " is no flag of palpate " + command;
    for (const std::string& given : {name, name + "=3"}) {
      const std::array typed{command.c_str(), "a.h5", given.c_str()};
      expect_named(cli::answer_to_former_flag(typed).value_or(""),
                   {("'" + given + "'" + words).c_str(), flag.remedy.data()});
    }
    const std::array after{command.c_str(), "--", name.c_str()};
    EXPECT_EQ(cli::answer_to_former_flag(after), std::nullopt) << "a file of this name";
    const std::array other{"no-command", name.c_str()};
    EXPECT_EQ(cli::answer_to_former_flag(other).has_value(), flag.command.empty());
  }
  const cli::FormerFlag& first = cli::former_flags().front();
  expect_refused({command_of(first), "a.h5", std::string(first.name)},
                 {std::string(first.name), std::string(first.remedy)});
}

// A row that hides a flag of today, or names one that there is not, misleads.
TEST_F(FormerFlags, TheTableAgreesWithTheHelp) {
  std::string all;
  std::map<std::string, std::string> help;
  for (const std::string command :
       {"batch", "calibrate", "check", "devices", "evaluate", "export", "import", "info", "live",
        "map", "merge", "plan", "recognize", "record", "sensors", "simulate", "touches", "view"}) {
    all += help[command] = done(command + " --help");
  }
  const auto names = [](const std::string& text, std::string_view flag) {
    return std::regex_search(text, std::regex(std::string(flag) + "(?![a-z-])"));
  };
  for (const cli::FormerFlag& flag : cli::former_flags()) {
    const std::string& of_command = flag.command.empty() ? all : help.at(command_of(flag));
    EXPECT_FALSE(names(of_command, flag.name)) << flag.command << " " << flag.name;
    const std::string remedy(flag.remedy);
    const std::regex named("--[a-z][a-z-]*");
    for (std::sregex_iterator at(remedy.begin(), remedy.end(), named), end; at != end; ++at) {
      EXPECT_TRUE(names(all, at->str())) << flag.name << ": " << at->str();
    }
  }
}

}  // namespace palpate::former_flags_test
