#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "palette.hpp"

namespace palpate::cli {

/// What a terminal can show.
enum class TerminalColours {
  none,     ///< plain ASCII without any escape code
  palette,  ///< 256 colours, UTF-8
  direct,   ///< 24 bits a colour, UTF-8
};

/// A point of a picture.
struct Pixel {
  Colour colour;
  double shade = 0.0;  ///< in [0, 1], for terminals without colours
  char mark = 0;       ///< ASCII, in the place of the shade; 0: none
};

/// Text and pictures in the cells of a terminal. A cell is about twice as high as wide and holds
/// two pixels, one above the other. What lies beyond the canvas is cut off.
class TerminalCanvas {
 public:
  TerminalCanvas(int columns, int rows);

  int columns() const { return columns_; }
  int rows() const { return rows_; }

  /// Writes printable UTF-8, one column for each code point; anything else becomes '?'.
  void text(int column, int row, std::string_view text, bool strong = false);
  /// A bar of `filled` of `columns` columns, in eighths of one, in this colour.
  void bar(int column, int row, int columns, double fraction, const Colour& colour);
  /// Pixel row 2 r is the upper half of the cells of row r.
  void pixel(int column, int pixel_row, const Pixel& pixel);

  /// The rows, without line ends and without trailing blanks; colours are left as they were before.
  std::vector<std::string> lines(TerminalColours colours) const;

 private:
  struct Cell {
    std::string glyph = " ";
    char ascii = ' ';  ///< in the place of a glyph that is not
    bool strong = false;
    bool coloured = false;  ///< glyph in the colour of `upper`
    bool pixels = false;    ///< upper and lower instead of the glyph
    Pixel upper;
    Pixel lower;
  };

  Cell* at(int column, int row);

  int columns_;
  int rows_;
  std::vector<Cell> cells_;
};

}  // namespace palpate::cli
