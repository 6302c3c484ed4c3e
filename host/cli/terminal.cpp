#include "cli/terminal.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <string_view>

namespace palpate::cli {

namespace {

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string() : value;
}

/// Whether the locale is UTF-8: as for setlocale(), the first variable that is set decides.
bool shows_utf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    std::string locale = environment(name);
    if (!locale.empty()) {
      std::transform(locale.begin(), locale.end(), locale.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      return locale.find("utf-8") != locale.npos || locale.find("utf8") != locale.npos;
    }
  }
  return false;
}

}  // namespace

bool terminal_moves_cursor() {
  const std::string term = environment("TERM");
  return !term.empty() && term != "dumb";
}

TerminalColours terminal_colours() {
  if (!terminal_moves_cursor() || !shows_utf8() || !environment("NO_COLOR").empty()) {
    return TerminalColours::none;
  }
  const std::string depth = environment("COLORTERM");
  if (depth == "truecolor" || depth == "24bit") {
    return TerminalColours::direct;
  }
  return environment("TERM").find("256color") != std::string::npos ? TerminalColours::palette
                                                                   : TerminalColours::none;
}

std::optional<int> terminal_columns(int output) {
  if (::isatty(output) == 0) {
    return {};
  }
  const std::string wish = environment("COLUMNS");
  int columns = 0;
  const auto [end, error] = std::from_chars(wish.data(), wish.data() + wish.size(), columns);
  const bool given = error == std::errc{} && end == wish.data() + wish.size() && columns > 0;
  return given ? columns : Terminal::size_of(output).columns;
}

Terminal::Terminal(int output, int input) : output_(output), input_(input) {
  termios settings{};
  if (::tcgetattr(input_, &settings) == 0) {
    before_ = settings;
    settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    settings.c_cc[VMIN] = 0;
    settings.c_cc[VTIME] = 0;
    settings.c_cc[VSUSP] = _POSIX_VDISABLE;  // Ctrl-Z would leave the screen as it is
    ::tcsetattr(input_, TCSANOW, &settings);
  }
  // Alternate screen, no cursor, and no wrapping: a shrinking window must not break lines.
  write("\033[?1049h\033[?25l\033[?7l\033[H\033[2J");
}

Terminal::~Terminal() {
  write("\033[0m\033[?7h\033[?25h\033[?1049l");
  if (before_) {
    ::tcsetattr(input_, TCSANOW, &*before_);
  }
}

Terminal::Size Terminal::size_of(int output) {
  winsize window{};
  Size size;
  if (::ioctl(output, TIOCGWINSZ, &window) == 0 && window.ws_col > 0 && window.ws_row > 0) {
    size = {.columns = window.ws_col, .rows = window.ws_row};
  }
  return size;
}

void Terminal::show(const std::vector<std::string>& lines) {
  std::string text = "\033[H";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    // No line end after the last one, or the screen would scroll.
    text += lines[i] + "\033[K" + (i + 1 < lines.size() ? "\r\n" : "\033[J");
  }
  write(text);
}

std::string Terminal::keys() {
  std::string keys;
  pollfd ready{.fd = input_, .events = POLLIN, .revents = 0};
  while (before_ && ::poll(&ready, 1, 0) > 0 && (ready.revents & POLLIN) != 0) {
    char piece[64];
    const ssize_t got = ::read(input_, piece, sizeof piece);
    if (got <= 0) {
      break;
    }
    keys.append(piece, static_cast<std::size_t>(got));
  }
  return keys;
}

// If the terminal is closed or a signal comes, the picture is incomplete, but the work goes on.
void Terminal::write(const std::string& text) const {
  std::string_view rest = text;
  while (!rest.empty()) {
    const ssize_t written = ::write(output_, rest.data(), rest.size());
    if (written <= 0) {
      return;
    }
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace palpate::cli
