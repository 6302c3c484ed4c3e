#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include <fmt/format.h>

#include "commands.hpp"
#include "palpate/error.hpp"

namespace {

// The exit status that other programs rely on.
constexpr int wrong_input = 2;
constexpr int failed = 1;

int complain(int status, const std::string& message) {
  fmt::print(stderr, "palpate: {}\n", message);
  return status;
}

/// CLI11's messages may span lines; ours are one.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Palpate recognises and locates objects by touch, on Vulkan compute.", "palpate");
  app.set_version_flag("--version", PALPATE_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App*, const CLI::Error&) { return std::string(); });
  palpate::cli::add_devices(app);
  palpate::cli::add_simulate(app);
  palpate::cli::add_map(app);
  palpate::cli::add_recognize(app);
  palpate::cli::add_info(app);

  try {
    app.parse(argc, argv);
    if (std::fflush(stdout) != 0) {
      return complain(failed, "standard output: cannot be written; is the disk full?");
    }
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      return app.exit(error);  // --help, --version
    }
    const auto commands = app.get_subcommands();
    return complain(wrong_input,
                    fmt::format("{}; see palpate {}--help", first_line(error.what()),
                                commands.empty() ? "" : commands.front()->get_name() + " "));
  } catch (const palpate::Error& error) {
    return complain(error.fault() == palpate::Fault::input ? wrong_input : failed, error.what());
  } catch (const std::bad_alloc&) {
    return complain(failed, "out of memory; use fewer bins, objects or cells");
  } catch (const std::exception& error) {
    return complain(failed, error.what());
  }
}
