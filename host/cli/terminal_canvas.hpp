#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "figures/palette.hpp"

namespace palpate::cli {

/// The colours that a terminal can show.
enum class TerminalColours {
  none,     ///< plain ASCII without any escape code
  palette,  ///< the 256 colours of xterm, UTF-8
  direct,   ///< 24-bit colours, UTF-8
};

/// A point of a picture.
struct Pixel {
  Colour colour;
  double shade = 0.0;  ///< darkness in [0, 1] on terminals without colours
  char mark = 0;       ///< ASCII character to show there instead of the shade; 0: none
};

/// Text and pictures in the character cells of a terminal. A cell is about twice as high as wide
/// and holds two pixels, one above the other. What lies outside the canvas is cut off.
class TerminalCanvas {
 public:
  TerminalCanvas(int columns, int rows);

  /// Writes UTF-8 text, one column per code point; characters that are not printable become '?'.
  /// @param strong in bold
  void text(int column, int row, std::string_view text, bool strong = false);
  /// Draws a horizontal bar over `fraction` of `columns` columns, to an eighth of a column.
  void bar(int column, int row, int columns, double fraction, const Colour& colour);
  /// Sets a pixel; pixel rows 2 r and 2 r + 1 are the upper and the lower half of row r.
  void pixel(int column, int pixel_row, const Pixel& pixel);

  /// The rows as lines without line end and trailing blanks. A line resets the colours it has set.
  std::vector<std::string> lines(TerminalColours colours) const;

 private:
  struct Cell {
    std::string glyph = " ";
    char ascii = ' ';  ///< shown instead of the glyph on terminals without colours
    bool strong = false;
    bool coloured = false;  ///< the glyph has the colour of `upper`
    bool pixels = false;    ///< `upper` and `lower` are shown instead of the glyph
    Pixel upper;
    Pixel lower;
  };

  Cell* at(int column, int row);

  int columns_;
  int rows_;
  std::vector<Cell> cells_;
};

}  // namespace palpate::cli
