#pragma once

#include <termios.h>

#include <optional>
#include <string>
#include <vector>

#include "terminal_canvas.hpp"

namespace palpate::cli {

/// What the terminal can show, by TERM, COLORTERM, NO_COLOR and the locale's character set.
TerminalColours terminal_colours();
/// False for a terminal that only prints line after line: TERM=dumb or none.
bool terminal_moves_cursor();

/// A terminal as a whole screen, and its keys. While it lives the cursor is hidden and what stood
/// there before is kept, to be shown again. Only one at a time.
class Terminal {
 public:
  struct Size {
    int columns = 80;
    int rows = 24;
  };

  /// @param output descriptor of a terminal to draw on
  /// @param input descriptor that keys are read from, if it is a terminal
  Terminal(int output, int input);
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// By now: it changes with the window.
  Size size() const { return size_of(output_); }
  static Size size_of(int output);

  /// Shows these lines from the top of the screen on; there must be no more than rows.
  void show(const std::vector<std::string>& lines);
  /// The keys pressed since the last call.
  std::string keys();
  bool has_keys() const { return before_.has_value(); }

 private:
  void write(const std::string& text) const;

  int output_;
  int input_;
  std::optional<termios> before_;  ///< how the input was set, where it was changed
};

}  // namespace palpate::cli
