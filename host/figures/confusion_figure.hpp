#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace palpate {

/// Contents of the picture of a confusion matrix.
struct ConfusionFigure {
  struct Row {
    std::string name;                 ///< of the true class
    std::string right;                ///< the column that is right; may be none of them
    std::vector<std::size_t> counts;  ///< [column]
  };
  std::string title;
  std::vector<std::string> columns;  ///< the answers
  std::vector<Row> rows;
};

/// Draws the matrix and returns the bytes of a PNG file: the first row on top, every count in its
/// cell, the right ones on blue and the wrong ones on red, the darker the larger the share of its
/// row. Where there are too many classes for numbers, the cells have only their colours. The same
/// contents give the same bytes.
/// @throws Error without a row or a column, where a row has not one count for each column, or for
/// lack of memory
std::string draw_confusion(const ConfusionFigure& figure);

}  // namespace palpate
