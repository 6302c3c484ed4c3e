#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "figures/axes.hpp"
#include "figures/figures.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr double margin_px = 36.0;
constexpr double title_px = 64.0;
constexpr double axis_name_px = 36.0;  ///< of the words beside the labels
constexpr double gap_px = 10.0;        ///< between labels and cells
constexpr double longest_label_px = 280.0;
constexpr double bar_height_px = 20.0;
constexpr double narrowest_bar_px = 420.0;
constexpr double below_px = 66.0;  ///< of the bar's ticks and caption
constexpr double least_number_px = 18.0;

void validate(const ConfusionFigure& figure) {
  if (figure.rows.empty() || figure.columns.empty()) {
    throw Error(Fault::input, fmt::format("picture of a confusion: {} rows of {} columns; give at "
                                          "least one of each",
                                          figure.rows.size(), figure.columns.size()));
  }
  for (const ConfusionFigure::Row& row : figure.rows) {
    if (row.counts.size() != figure.columns.size() || row.proven.size() != row.counts.size()) {
      throw Error(Fault::input,
                  fmt::format("picture of a confusion: {} counts and {} shares for "
                              "{} columns; give one for each",
                              row.counts.size(), row.proven.size(), figure.columns.size()));
    }
  }
}

/// Edge of a cell in pixels: large for few classes, but with room for numbers as long as the
/// picture stays about 2,000 pixels wide.
double cell_px(const ConfusionFigure& figure) {
  const auto most = static_cast<double>(std::max(figure.rows.size(), figure.columns.size()));
  const double comfortable = std::clamp(900.0 / most, 38.0, 84.0);
  return std::max(std::floor(std::min(comfortable, 1800.0 / most)), 2.0);
}

/// Sizes that follow from the labels and the number of classes.
struct Layout {
  double cell = 0.0;
  Font label{};
  Font count{};
  bool upright = false;   ///< labels of columns read from bottom to top
  Box box{};              ///< of the cells
  std::size_t every = 1;  ///< of how many rows or columns one is labelled

  Layout(Canvas& ruler, const ConfusionFigure& figure) : cell(cell_px(figure)) {
    label.size_px = std::clamp(0.5 * cell, 11.0, 18.0);
    every = static_cast<std::size_t>(std::ceil((label.size_px + 2.0) / cell));
    double row_px = 0.0;
    std::size_t most = 0;
    for (const ConfusionFigure::Row& row : figure.rows) {
      row_px = std::max(row_px, ruler.text_width(row.name, label));
      most = std::max(most, *std::ranges::max_element(row.counts));
    }
    double column_px = 0.0;
    for (const std::string& column : figure.columns) {
      column_px = std::max(column_px, ruler.text_width(column, label));
    }
    upright = column_px > cell - 6.0;
    const double above = upright ? std::min(column_px, longest_label_px) : label.size_px;
    box = {margin_px + axis_name_px + std::min(row_px, longest_label_px) + gap_px,
           title_px + axis_name_px + above + gap_px,
           cell * static_cast<double>(figure.columns.size()),
           cell * static_cast<double>(figure.rows.size())};
    count.size_px = std::min(18.0, 0.5 * cell);
    const double widest = ruler.text_width(fmt::format("{}", most), count);
    count.size_px *= std::min(1.0, (cell - 4.0) / std::max(widest, 1.0));
  }

  bool has_numbers() const { return cell >= least_number_px; }
  glm::dvec2 centre(std::size_t row, std::size_t column) const {
    return {box.left + cell * (static_cast<double>(column) + 0.5),
            box.top + cell * (static_cast<double>(row) + 0.5)};
  }
};

void draw_labels(Canvas& canvas, const Layout& layout, const ConfusionFigure& figure) {
  for (std::size_t j = 0; j < figure.rows.size(); j += layout.every) {
    const std::string text = canvas.fit(figure.rows[j].name, longest_label_px, layout.label);
    canvas.text(text,
                {layout.box.left - gap_px, layout.centre(j, 0).y + layout.label.half_height_px()},
                layout.label, Align::right);
  }
  for (std::size_t i = 0; i < figure.columns.size(); i += layout.every) {
    const std::string text = canvas.fit(figure.columns[i], longest_label_px, layout.label);
    const glm::dvec2 at(layout.centre(0, i).x, layout.box.top - gap_px);
    if (layout.upright) {
      canvas.text_upwards(text, at + glm::dvec2(layout.label.half_height_px(), 0.0), layout.label,
                          Align::left);
    } else {
      canvas.text(text, at, layout.label, Align::centre);
    }
  }
  canvas.text_upwards("true class",
                      {margin_px + body.size_px, layout.box.top + 0.5 * layout.box.height}, body,
                      Align::centre);
  canvas.text("best label", {layout.box.left + 0.5 * layout.box.width, title_px + body.size_px},
              body, Align::centre);
}

void draw_cells(Canvas& canvas, const Layout& layout, const ConfusionFigure& figure) {
  const auto share = [&](std::size_t row, std::size_t column) {
    return figure.rows[row].proven[column];
  };
  const auto right = [&](std::size_t row, std::size_t column) {
    return figure.rows[row].right == figure.columns[column];
  };
  const int rows = static_cast<int>(figure.rows.size());
  canvas.cells(layout.box, static_cast<int>(figure.columns.size()), rows, [&](int i, int j) {
    const auto row = static_cast<std::size_t>(rows - 1 - j);
    const auto column = static_cast<std::size_t>(i);
    // Blue for the right answer, red for others; white for a share of 0.
    return diverging(right(row, column) ? -share(row, column) : share(row, column));
  });
  constexpr Pen grid{.colour = {0.85, 0.85, 0.85}, .width_px = 1.0};
  for (std::size_t j = 0; j < figure.rows.size() && layout.has_numbers(); ++j) {
    for (std::size_t i = 0; i < figure.columns.size(); ++i) {
      const glm::dvec2 centre = layout.centre(j, i);
      canvas.frame(
          {centre.x - layout.cell / 2, centre.y - layout.cell / 2, layout.cell, layout.cell}, grid);
      if (figure.rows[j].counts[i] > 0) {
        constexpr double dark = 0.55;
        canvas.text(fmt::format("{}", figure.rows[j].counts[i]),
                    {centre.x, centre.y + layout.count.half_height_px()}, layout.count,
                    Align::centre, share(j, i) > dark ? white : ink);
      }
    }
  }
  canvas.frame(layout.box, {.colour = ink, .width_px = 1.5});
}

}  // namespace

std::string draw_confusion(const ConfusionFigure& figure) {
  validate(figure);
  Canvas ruler(1, 1);  // measures text before the picture's size is known
  const Layout layout(ruler, figure);
  const double bar_top = layout.box.bottom() + 28.0;
  const double bar_px = std::max(layout.box.width, narrowest_bar_px);
  const double width =
      std::max(layout.box.left + bar_px, margin_px + ruler.text_width(figure.title, heading)) +
      margin_px;
  Canvas canvas(static_cast<int>(width), static_cast<int>(bar_top + bar_height_px + below_px));
  canvas.text(figure.title, {margin_px, 44.0}, heading);
  draw_labels(canvas, layout, figure);
  draw_cells(canvas, layout, figure);
  const std::vector<Tick> ticks{
      {-1.0, "100 %"}, {-0.5, "50 %"}, {0.0, "0"}, {0.5, "50 %"}, {1.0, "100 %"}};
  draw_colour_bar(canvas, {layout.box.left, bar_top, bar_px, bar_height_px}, -1.0, 1.0, diverging,
                  ticks, "share of its row, lower 95 % bound; blue: right");
  return canvas.encode();
}

}  // namespace palpate
