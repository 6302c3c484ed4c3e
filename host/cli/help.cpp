#include "cli/help.hpp"

#include <unistd.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "cli/terminal.hpp"

namespace palpate::cli {

namespace {

/// Flags that few uses need, by what they are for.
struct Group {
  const char* name;
  std::vector<const char*> flags;
};
const std::vector<Group>& groups() {
  static const std::vector<Group> all{
      {"Bins and region", {"--bins", "--x-mm", "--y-mm", "--theta-deg", "--pivot-mm"}},
      {"Likelihood",
       {"--prior", "--gamma", "--ratio", "--spread-mm", "--psf-mm", "--peak", "--felt-share"}},
      {"Misplaced touches and slip",
       {"--touch-sd-mm", "--touch-sd-deg", "--slip-sd-mm", "--slip-sd-deg", "--fit-touch-sd"}},
      {"Filter",
       {"--filter", "--tolerance", "--budget-ms", "--evidence-nats", "--particles", "--resampling",
        "--augmented", "--seed", "--memory-mib", "--device", "--verbose"}},
      {"Touches in a stream",
       {"--onset", "--release", "--steady", "--min-steady-s", "--smooth-s", "--drift-s", "--tare",
        "--reset-after"}},
      {"Columns and times of tables",
       {"--rows", "--pose-unit", "--time-unit", "--time-column", "--pressure-columns",
        "--pose-columns", "--plane", "--largest-gap-s", "--pose-delay", "--rate"}},
      {"Of --sensor -", {}},  // as the command groups them
      {"Work", {"--chunk", "--threads"}},
      {"Samples of the belief", {"--samples", "--plan-seed"}},
  };
  return all;
}

/// An explanation's beginning up to one of these ends.
std::string beginning(const std::string& words, std::initializer_list<const char*> ends) {
  constexpr std::size_t least = 17;  // an abbreviation or a list's head is no sentence
  std::size_t end = words.size();
  for (const char* each : ends) {
    end = std::min(end, words.find(each, least));
  }
  return words.substr(0, end);
}

/// The first sentence of an explanation, and its default.
std::string first_sentence(const std::string& words) {
  const std::size_t otherwise = std::min(words.rfind(" [default:"), words.size());
  return beginning(words.substr(0, otherwise), {"; ", ". ", ": "}) + words.substr(otherwise);
}

class Help : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    const bool all = mode == CLI::AppFormatMode::All || app->get_parent() == nullptr;
    const std::string& about = app->get_description();
    std::string text =
        wrapped(all ? about : first_sentence(about), 0) + "\n\n" + make_usage(app, name);
    std::string others;
    add_options(text, "Positionals", *app, "", true, all);
    for (const std::string& group : app->get_groups()) {
      const std::vector<const CLI::Option*> options = options_of(*app, group, false);
      const bool known =
          std::ranges::any_of(groups(), [&group](const Group& each) { return group == each.name; });
      if (all || !known) {
        add_options(text, group, *app, group, false, all);
        continue;
      }
      std::vector<std::string> names;
      for (const CLI::Option* option : options) {
        names.push_back(option->get_name());
      }
      others += wrapped(fmt::format("  {}: {}", group, fmt::join(names, ", ")), 4) + "\n";
    }
    if (const auto commands = app->get_subcommands({}); !commands.empty()) {
      text += "\nSubcommands:\n";
      for (const CLI::App* command : commands) {
        text += wrapped(fmt::format("  {:<11} {}", command->get_name(),
                                    beginning(command->get_description(), {". ", "; ", ": "})),
                        14) +
                "\n";
      }
      text += "\n" + wrapped("palpate COMMAND --help explains a command.", 0) + "\n";
    }
    if (!others.empty()) {
      text += "\nMore flags:\n" + others;
    }
    if (!all) {
      text += "\n" + wrapped("--help-all explains all flags in full.", 0) + "\n";
    }
    return text;
  }

 private:
  /// Columns of the terminal; none elsewhere, where lines are as long as they are.
  std::optional<int> columns_ = terminal_columns(STDOUT_FILENO);

  std::string wrapped(const std::string& words, std::size_t indent) const {
    if (!columns_) {
      return words;
    }
    const auto width = static_cast<std::size_t>(std::clamp(*columns_, 40, 110));
    std::string text;
    std::string_view rest = words;
    for (std::size_t room = width; rest.size() > room; room = width - indent) {
      std::size_t end = rest.rfind(' ', room);
      end = end == 0 || end == std::string_view::npos || rest.find_first_not_of(' ') > end
                ? std::min(rest.find(' ', room), rest.size())
                : end;
      text.append(rest.substr(0, end)).append("\n").append(indent, ' ');
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return text.append(rest);
  }

  static std::vector<const CLI::Option*> options_of(const CLI::App& app, const std::string& group,
                                                    bool positional) {
    return app.get_options([&](const CLI::Option* option) {
      return option->get_positional() == positional &&
             (positional || option->get_group() == group) && !option->get_group().empty();
    });
  }

  void add_options(std::string& text, const std::string& title, const CLI::App& app,
                   const std::string& group, bool positional, bool full) const {
    const auto options = options_of(app, group, positional);
    if (options.empty()) {
      return;
    }
    constexpr std::size_t column = 26;
    text += "\n" + title + ":\n";
    for (const CLI::Option* option : options) {
      const std::string opts = make_option_opts(option);
      const std::size_t kept =
          full ? opts.npos : std::min(opts.find(" Excludes:"), opts.find(" Needs:"));
      const std::string name = "  " + make_option_name(option, positional) + opts.substr(0, kept);
      const std::string words = make_option_desc(option);
      const std::string explained = full ? words : first_sentence(words);
      if (name.size() < column) {
        text += wrapped(fmt::format("{:<{}}{}", name, column, explained), column);
      } else {
        text += wrapped(name, 4) + "\n" + wrapped(std::string(column, ' ') + explained, column);
      }
      text += "\n";
    }
  }
};

/// Levenshtein's distance: how many letters differ, are missing or too many.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

void arrange_help(CLI::App& app) {
  const auto help = std::make_shared<Help>();
  app.formatter(help);
  for (CLI::App* command : app.get_subcommands({})) {
    command->formatter(help);
    command->set_help_all_flag("--help-all", "Explain all flags in full, and exit");
    for (const Group& group : groups()) {
      for (const char* flag : group.flags) {
        CLI::Option* option = command->get_option_no_throw(flag);
        // A seed is a filter's only where there is one.
        const bool own = std::string_view(flag) == "--seed" &&
                         command->get_option_no_throw("--particles") == nullptr;
        if (option != nullptr && option->get_group() == "Options" && !own) {
          option->group(group.name);
        }
      }
    }
  }
}

std::string suggestion(const CLI::App& app, const CLI::App* command, const std::string& typed) {
  std::vector<std::string> names;
  if (command == nullptr) {
    for (const CLI::App* each : app.get_subcommands({})) {
      names.push_back(each->get_name());
    }
  } else {
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) {
        names.push_back("--" + name);
      }
    }
  }
  const std::string word = typed.substr(0, typed.find('='));
  const auto far = [&word](const std::string& name) { return distance(word, name); };
  const auto nearest = std::ranges::min_element(names, {}, far);
  // A third of the letters may be wrong.
  return nearest == names.end() || 3 * far(*nearest) > nearest->size()
             ? ""
             : fmt::format("; did you mean {}?", *nearest);
}

}  // namespace palpate::cli
