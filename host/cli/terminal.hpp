#pragma once

#include <termios.h>

#include <optional>
#include <string>
#include <vector>

#include "cli/terminal_canvas.hpp"

namespace palpate::cli {

/// The colours that the terminal can show, by TERM, COLORTERM, NO_COLOR and the locale.
TerminalColours terminal_colours();
/// Whether the terminal can move the cursor; not so with TERM=dumb or without TERM.
bool terminal_moves_cursor();

/// Columns of the terminal that a file descriptor belongs to, by COLUMNS or its window; none where
/// it is no terminal.
std::optional<int> terminal_columns(int output);

/// Draws on the whole screen of a terminal and reads its keys. During its lifetime the cursor is
/// hidden; the destructor shows the former screen again. Only one object may exist at a time.
class Terminal {
 public:
  struct Size {
    int columns = 80;
    int rows = 24;
  };

  /// @param output file descriptor of the terminal
  /// @param input file descriptor that keys are read from, if it is a terminal
  Terminal(int output, int input);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// The present size, which follows the window.
  static Size size_of(int output);

  /// Shows the lines from the top of the screen on; there may be at most as many as rows.
  void show(const std::vector<std::string>& lines);
  /// The keys pressed since the last call.
  std::string keys();
  bool has_keys() const { return before_.has_value(); }

 private:
  void write(const std::string& text) const;

  int output_;
  int input_;
  std::optional<termios> before_;  ///< former settings of the input, if it is a terminal
};

}  // namespace palpate::cli
