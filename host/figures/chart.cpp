#include "figures/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

/// Returns the corners of a mark's outline; none for a circle.
std::vector<glm::dvec2> corners_of(Mark mark, glm::dvec2 at) {
  const double r = radius_px;
  switch (mark) {
    case Mark::square:
      return {at + glm::dvec2(-r, -r), at + glm::dvec2(r, -r), at + glm::dvec2(r, r),
              at + glm::dvec2(-r, r)};
    case Mark::triangle:
      return {at + glm::dvec2(0.0, -1.2 * r), at + glm::dvec2(1.2 * r, 0.9 * r),
              at + glm::dvec2(-1.2 * r, 0.9 * r)};
    case Mark::diamond:
      return {at + glm::dvec2(0.0, -1.3 * r), at + glm::dvec2(1.3 * r, 0.0),
              at + glm::dvec2(0.0, 1.3 * r), at + glm::dvec2(-1.3 * r, 0.0)};
    default:
      return {};
  }
}

void draw_mark(Canvas& canvas, const ChartSeries& series, glm::dvec2 at) {
  // A white edge separates marks that overlap.
  const Pen edge{.colour = white, .width_px = 1.5};
  if (series.mark == Mark::circle) {
    canvas.disc(at, radius_px, series.colour);
    canvas.circle(at, radius_px, edge);
  } else if (series.mark != Mark::none) {
    const std::vector<glm::dvec2> corners = corners_of(series.mark, at);
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
  Plot(Canvas& canvas, const AxisSpan& x, const AxisSpan& y, const Box& box)
      : canvas_(canvas),
        x_(x),
        y_(y),
        view_{.box = box, .lower = {x.lower, y.lower}, .upper = {x.upper, y.upper}} {}

  const View& view() const { return view_; }

  /// Draws a line through the whole plot.
  void rule(double place, bool vertical, const Pen& pen) {
    const Box& box = view_.box;
    const glm::dvec2 at = view_.pixel({place, place});
    canvas_.line(vertical ? std::array{glm::dvec2(at.x, box.top), glm::dvec2(at.x, box.bottom())}
                          : std::array{glm::dvec2(box.left, at.y), glm::dvec2(box.right(), at.y)},
                 pen);
  }

  void grid() {
    const Pen pen{.colour = {0.84, 0.84, 0.84}, .width_px = 1.5};
    for (const Tick& tick : x_.ticks) {
      rule(tick.value, true, pen);
    }
    for (const Tick& tick : y_.ticks) {
      rule(tick.value, false, pen);
    }
  }

  void intervals(const ChartSeries& series) {
    const Pen pen{.colour = series.colour, .width_px = 2.0};
    constexpr glm::dvec2 half_cap(5.0, 0.0);
    for (const ChartPoint& point : series.points) {
      if (drawn(point) && point.low <= point.high) {
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
    std::vector<glm::dvec2> run;
    const auto draw = [&] {
      if (series.line != Line::none && run.size() > 1) {
        canvas_.line(run, pen_of(series));
      }
      run.clear();
    };
    for (const ChartPoint& point : series.points) {
      if (drawn(point)) {
        run.push_back(pixel(point));
      } else {
        draw();
      }
    }
    draw();
  }

  void marks(const ChartSeries& series) {
    for (const ChartPoint& point : series.points) {
      if (!drawn(point) || !view_.contains({point.x, point.y})) {
        continue;
      }
      const glm::dvec2 at = pixel(point);
      draw_mark(canvas_, series, at);
      if (series.mark != Mark::none) {
        taken_.push_back({at.x - radius_px, at.y - radius_px, 2.0 * radius_px, 2.0 * radius_px});
      }
    }
  }

  void labels(const ChartSeries& series) {
    for (const ChartPoint& point : series.points) {
      if (drawn(point) && !point.label.empty()) {
        label(point.label, pixel(point), series.colour);
      }
    }
  }

 private:
  static bool drawn(const ChartPoint& point) {
    return std::isfinite(point.x) && std::isfinite(point.y);
  }
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
  const AxisSpan& x_;
  const AxisSpan& y_;
  View view_;
  std::vector<Box> taken_;  ///< boxes of marks and text
};

constexpr int most_ticks = 7;

std::string text_of(const ChartAxis& axis, double value) {
  return axis.text ? axis.text(value) : number(value);
}

/// Ends the axis at whole ticks, so that no curve meets the frame between two ticks.
void set_ticks(const ChartAxis& axis, AxisSpan& span) {
  const std::vector<Tick> within = even_ticks(span.lower, span.upper, most_ticks);
  const double step = within.size() > 1 ? within[1].value - within[0].value : 0.0;
  if (step > 0.0) {
    span.lower = axis.lower.value_or(step * std::floor(span.lower / step + 1e-9));
    span.upper = axis.upper.value_or(step * std::ceil(span.upper / step - 1e-9));
  }
  for (const Tick& tick : even_ticks(span.lower, span.upper, most_ticks + 2, step)) {
    span.ticks.push_back({tick.value, text_of(axis, tick.value)});
  }
}

AxisSpan span_of_axis(const Chart& chart, bool along_x) {
  std::vector<double> values;
  for (const ChartSeries& series : chart.series) {
    for (const ChartPoint& point : series.points) {
      if (along_x) {
        values.push_back(point.x);
      } else {
        values.insert(values.end(), {point.y, point.low, point.high});
      }
    }
  }
  if (along_x && chart.rule) {
    values.push_back(*chart.rule);
  }
  return span_of(along_x ? chart.x : chart.y, values);
}

}  // namespace

AxisSpan span_of(const ChartAxis& axis, std::span<const double> values) {
  AxisSpan span{.lower = std::numeric_limits<double>::infinity(),
                .upper = -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (std::isfinite(value)) {
      span.lower = std::min(span.lower, value);
      span.upper = std::max(span.upper, value);
    }
  }
  if (span.lower > span.upper) {
    span.lower = span.upper = 0.0;
  }
  span.lower = axis.lower.value_or(span.lower);
  span.upper = axis.upper.value_or(span.upper);
  if (!(span.lower < span.upper)) {
    span.upper = span.lower + 1.0;
  }
  set_ticks(axis, span);
  return span;
}

std::string draw_chart(const Chart& chart) {
  const AxisSpan x = span_of_axis(chart, true);
  const AxisSpan y = span_of_axis(chart, false);
  Canvas ruler(1, 1);  // measures text before the picture's size is known
  double widest_px = 0.0;
  for (const Tick& tick : y.ticks) {
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
  Plot plot(canvas, x, y, {left_px, top_px, plot_px, plot_height_px});
  plot.grid();
  {
    const Canvas::Clip inside(canvas, plot.view().box);
    for (const ChartSeries& series : chart.series) {
      plot.intervals(series);
    }
    for (const ChartSeries& series : chart.series) {
      plot.line(series);
    }
  }
  draw_axes(canvas, plot.view(), x.ticks, y.ticks, chart.x.label, chart.y.label);
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
