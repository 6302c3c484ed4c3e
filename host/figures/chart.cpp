#include "figures/chart.hpp"

#include <algorithm>
#include <array>

#include "figures/axes.hpp"
#include "figures/canvas.hpp"

namespace palpate {

namespace {

constexpr double width_px = 1440.0;
constexpr double plot_height_px = 640.0;
constexpr double right_px = 36.0;
constexpr double below_px = 72.0;
constexpr double row_px = 32.0;  // of the legend
constexpr double sample_px = 64.0;
constexpr double radius_px = 7.5;

void draw_mark(Canvas& canvas, const ChartSeries& series, glm::dvec2 at, double size = 1.0) {
  // A white edge separates marks that overlap.
  const Pen edge{.colour = white, .width_px = 1.5};
  if (series.mark == Mark::circle) {
    canvas.disc(at, size * radius_px, series.colour);
    canvas.circle(at, size * radius_px, edge);
  } else if (series.mark == Mark::square) {
    const double r = size * radius_px;
    const std::array corners{at + glm::dvec2(-r, -r), at + glm::dvec2(r, -r), at + glm::dvec2(r, r),
                             at + glm::dvec2(-r, r)};
    canvas.fill(corners, series.colour);
    canvas.polygon(corners, edge);
  }
}

Pen pen_of(const ChartSeries& series) {
  return {.colour = series.colour, .width_px = 3.0, .dotted = series.line == Line::dotted};
}

bool meet(const Box& a, const Box& b) {
  return a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom();
}

bool free_of(const Box& box, const std::vector<Box>& taken) {
  return std::none_of(taken.begin(), taken.end(),
                      [&](const Box& other) { return meet(box, other); });
}

/// The legend: rows of as many entries as fit, each as wide as the widest entry.
struct Legend {
  std::vector<const ChartSeries*> entries;
  double column_px = 0.0;
  std::size_t rows = 0;
  std::size_t columns = 1;

  Legend(Canvas& canvas, const Chart& chart, double room_px) {
    for (const ChartSeries& series : chart.series) {
      if (!series.name.empty()) {
        entries.push_back(&series);
        column_px = std::max(column_px, sample_px + 48.0 + canvas.text_width(series.name, body));
      }
    }
    if (!entries.empty()) {
      const auto most = std::max<std::size_t>(1, static_cast<std::size_t>(room_px / column_px));
      rows = (entries.size() + most - 1) / most;
      columns = (entries.size() + rows - 1) / rows;
    }
  }

  double height_px() const { return row_px * static_cast<double>(rows); }

  void draw(Canvas& canvas, glm::dvec2 corner) const {
    for (std::size_t i = 0; i < entries.size(); ++i) {
      const ChartSeries& series = *entries[i];
      const std::size_t row = i / columns;
      const std::size_t column = i % columns;
      const glm::dvec2 left = corner + glm::dvec2(column_px * static_cast<double>(column),
                                                  row_px * (static_cast<double>(row) + 0.5));
      const glm::dvec2 right = left + glm::dvec2(sample_px, 0.0);
      if (series.line != Line::none) {
        canvas.segment(left, right, pen_of(series));
      }
      draw_mark(canvas, series, 0.5 * (left + right));
      canvas.text(series.name, right + glm::dvec2(12.0, 7.0), body);
    }
  }
};

/// Draws the contents of the frame of the axes.
class Plot {
 public:
  Plot(Canvas& canvas, const View& view) : canvas_(canvas), view_(view) {}

  /// Draws a line through the whole plot.
  void rule(double place, bool vertical, const Pen& pen) {
    const Box& box = view_.box;
    const glm::dvec2 at = view_.pixel({place, place});
    canvas_.line(vertical ? std::array{glm::dvec2(at.x, box.top), glm::dvec2(at.x, box.bottom())}
                          : std::array{glm::dvec2(box.left, at.y), glm::dvec2(box.right(), at.y)},
                 pen);
  }

  void intervals(const ChartSeries& series) {
    Pen pen{.colour = series.colour, .width_px = 2.0};
    constexpr glm::dvec2 half_cap(5.0, 0.0);
    for (const ChartPoint& point : series.points) {
      pen.colour.alpha = point.size;
      if (point.low <= point.high) {
        const std::array ends{view_.pixel({point.x, point.low}),
                              view_.pixel({point.x, point.high})};
        canvas_.line(ends, pen);
        for (const glm::dvec2& end : ends) {
          canvas_.segment(end - half_cap, end + half_cap, pen);
        }
      }
    }
  }

  void line(const ChartSeries& series) {
    std::vector<glm::dvec2> points;
    for (const ChartPoint& point : series.points) {
      points.push_back(pixel(point));
    }
    if (series.line != Line::none && points.size() > 1) {
      canvas_.line(points, pen_of(series));
    }
  }

  void marks(const ChartSeries& series) {
    for (const ChartPoint& point : series.points) {
      const glm::dvec2 at = pixel(point);
      draw_mark(canvas_, series, at, point.size);
      if (series.mark != Mark::none) {
        taken_.push_back({at.x - radius_px, at.y - radius_px, 2.0 * radius_px, 2.0 * radius_px});
      }
    }
  }

  void labels(const ChartSeries& series) {
    for (const ChartPoint& point : series.points) {
      if (!point.label.empty()) {
        label(point.label, pixel(point), series.colour);
      }
    }
  }

 private:
  glm::dvec2 pixel(const ChartPoint& point) const { return view_.pixel({point.x, point.y}); }

  /// Writes the text beside the point where it covers no mark and no other label, or not at all.
  void label(const std::string& text, glm::dvec2 at, const Colour& colour) {
    const double w = canvas_.text_width(text, small);
    constexpr double h = 20.0;
    constexpr double gap = radius_px + 4.0;
    const std::array<glm::dvec2, 6> corners{{{at.x + gap, at.y - h / 2},
                                             {at.x - w / 2, at.y - gap - h},
                                             {at.x - w / 2, at.y + gap},
                                             {at.x - gap - w, at.y - h / 2},
                                             {at.x + gap, at.y - gap - h / 2},
                                             {at.x - gap - w, at.y + gap - h / 2}}};
    for (const glm::dvec2& corner : corners) {
      const Box box{corner.x, corner.y, w, h};
      const Box& all = view_.box;
      if (box.left >= all.left && box.right() <= all.right() && box.top >= all.top &&
          box.bottom() <= all.bottom() && free_of(box, taken_)) {
        taken_.push_back(box);
        canvas_.text(text, {box.left, box.bottom() - 4.0}, small, Align::left, colour);
        return;
      }
    }
  }

  Canvas& canvas_;
  const View& view_;
  std::vector<Box> taken_;  ///< boxes of marks and text
};

std::vector<Tick> ticks_of(const ChartAxis& axis) {
  constexpr int most_ticks = 7;
  return axis.ticks.empty() ? even_ticks(axis.lower, axis.upper, most_ticks) : axis.ticks;
}

}  // namespace

std::string draw_chart(const Chart& chart) {
  const std::vector<Tick> x_ticks = ticks_of(chart.x);
  const std::vector<Tick> y_ticks = ticks_of(chart.y);
  Canvas ruler(1, 1);  // measures text before the picture's size is known
  double widest_px = 0.0;
  for (const Tick& tick : y_ticks) {
    widest_px = std::max(widest_px, ruler.text_width(tick.label, small));
  }
  const double left_px = std::max(92.0, widest_px + 50.0);
  const double plot_px = width_px - left_px - right_px;
  const Legend legend(ruler, chart, plot_px);
  const double title_px = chart.title.empty() ? 0.0 : 44.0;
  const double top_px = 16.0 + title_px + legend.height_px() + 12.0;

  const int height = static_cast<int>(top_px + plot_height_px + below_px);
  Canvas canvas(static_cast<int>(width_px), height);
  if (!chart.title.empty()) {
    canvas.text(chart.title, {left_px, 16.0 + heading.size_px}, heading);
  }
  legend.draw(canvas, {left_px, 16.0 + title_px});
  const View view{.box = {left_px, top_px, plot_px, plot_height_px},
                  .lower = {chart.x.lower, chart.y.lower},
                  .upper = {chart.x.upper, chart.y.upper}};
  Plot plot(canvas, view);
  const Pen grid{.colour = {0.84, 0.84, 0.84}, .width_px = 1.5};
  for (const Tick& tick : x_ticks) {
    plot.rule(tick.value, true, grid);
  }
  for (const Tick& tick : y_ticks) {
    plot.rule(tick.value, false, grid);
  }
  {
    const Canvas::Clip inside(canvas, view.box);
    for (const ChartSeries& series : chart.series) {
      plot.intervals(series);
    }
    for (const ChartSeries& series : chart.series) {
      plot.line(series);
    }
  }
  const bool two_parts = chart.rule && !chart.left_of_rule.empty();
  draw_axes(canvas, view, x_ticks, y_ticks, two_parts ? "" : chart.x.label, chart.y.label);
  if (two_parts) {
    const auto name = [&](const std::string& part, double lower, double upper) {
      canvas.text(part, {view.pixel({0.5 * (lower + upper), 0.0}).x, view.box.bottom() + 54.0},
                  body, Align::centre);
    };
    name(chart.left_of_rule, chart.x.lower, *chart.rule);
    name(chart.x.label, *chart.rule, chart.x.upper);
  }
  for (const ChartSeries& series : chart.series) {
    plot.marks(series);
  }
  if (chart.rule) {
    plot.rule(*chart.rule, true, {.colour = comparison_grey, .width_px = 2.2, .dotted = true});
  }
  for (const ChartSeries& series : chart.series) {
    plot.labels(series);
  }
  return canvas.encode();
}

}  // namespace palpate
