#include "svg_chart.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "chart_style.hpp"

namespace palpate::bench {

namespace {

constexpr double width = 920.0;
constexpr double left = 70.0;
constexpr double right = 24.0;
constexpr double plot_height = 400.0;
constexpr double bottom = 54.0;
constexpr double legend_row = 22.0;
constexpr double character = 6.3;  // mean advance of the 11 px labels, rounded up
constexpr double label_height = 13.0;
constexpr double radius = 5.0;

struct Box {
  double x0 = 0.0;
  double y0 = 0.0;
  double x1 = 0.0;
  double y1 = 0.0;

  bool meets(const Box& other) const {
    return x0 < other.x1 && other.x0 < x1 && y0 < other.y1 && other.y0 < y1;
  }
};

bool drawable(const ChartPoint& point) {
  return point.x > 0.0 && point.y > 0.0 && std::isfinite(point.x) && std::isfinite(point.y);
}

/// A logarithmic axis between two places of the picture.
struct LogAxis {
  double lower = std::numeric_limits<double>::infinity();
  double upper = 0.0;
  double from = 0.0;
  double to = 1.0;

  void hold(double value) {
    lower = std::min(lower, value);
    upper = std::max(upper, value);
  }
  /// Room at both ends, and some extent even for a single point.
  void close() {
    if (!(lower <= upper)) {
      lower = upper = 1.0;
    }
    const double room = std::max(std::pow(upper / lower, 0.06), 1.15);
    lower /= room;
    upper *= room;
  }
  double at(double value) const {
    return from + (to - from) * std::log(value / lower) / std::log(upper / lower);
  }
  double decades() const { return std::log10(upper / lower); }

  struct Tick {
    double value = 0.0;
    bool labelled = false;
  };
  /// 1, 2, ... 9 of every decade; labels for the decades, and on short axes for 2 and 5 or for all.
  std::vector<Tick> ticks() const {
    std::vector<Tick> ticks;
    for (double decade = std::floor(std::log10(lower)); decade <= std::log10(upper); ++decade) {
      for (int digit = 1; digit <= 9; ++digit) {
        const double value = digit * std::pow(10.0, decade);
        if (value >= lower && value <= upper && (digit == 1 || decades() < 8.0)) {
          const bool labelled = digit == 1 || (decades() < 3.2 && (digit == 2 || digit == 5)) ||
                                (decades() < 0.8 && digit < 9);
          ticks.push_back({value, labelled});
        }
      }
    }
    return ticks;
  }
};

std::string mark_of(const ChartSeries& series, double x, double y) {
  const char* fill = series.fill == Fill::solid  ? "solid"
                     : series.fill == Fill::half ? "half"
                                                 : "hollow";
  const std::string look = fmt::format("class=\"c{} {}\"", series.colour, fill);
  switch (series.shape) {
    case Shape::circle:
      return fmt::format("<circle {} cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", look, x, y, radius);
    case Shape::square:
      return fmt::format("<rect {} x=\"{:.1f}\" y=\"{:.1f}\" width=\"9\" height=\"9\"/>", look,
                         x - 4.5, y - 4.5);
    case Shape::triangle:
      return fmt::format("<path {} d=\"M{:.1f} {:.1f}l6 10.5h-12z\"/>", look, x, y - 7.0);
    case Shape::diamond:
      return fmt::format("<path {} d=\"M{:.1f} {:.1f}l6 6.5l-6 6.5l-6 -6.5z\"/>", look, x, y - 6.5);
  }
  return {};
}

/// Where a label fits beside a point, if anywhere: its box.
std::optional<Box> place_label(double x, double y, double text_width, const Box& plot,
                               const std::vector<Box>& taken) {
  const double gap = radius + 3.0;
  const double half = label_height / 2.0;
  const Box places[] = {
      {x + gap, y - half, x + gap + text_width, y + half},
      {x - text_width / 2.0, y - gap - label_height, x + text_width / 2.0, y - gap},
      {x - text_width / 2.0, y + gap, x + text_width / 2.0, y + gap + label_height},
      {x - gap - text_width, y - half, x - gap, y + half},
      {x + gap - 2.0, y - gap - half, x + gap + text_width - 2.0, y - gap + half},
      {x - gap - text_width, y + gap - half, x - gap, y + gap + half},
  };
  for (const Box& place : places) {
    const bool inside =
        place.x0 >= plot.x0 && place.x1 <= plot.x1 && place.y0 >= plot.y0 && place.y1 <= plot.y1;
    if (inside && std::none_of(taken.begin(), taken.end(),
                               [&](const Box& other) { return place.meets(other); })) {
      return place;
    }
  }
  return {};
}

/// One chart on its way to SVG.
class Drawing {
 public:
  explicit Drawing(const Chart& chart) : chart_(chart) {
    for (const ChartSeries& series : chart.series) {
      for (const ChartPoint& point : series.points) {
        if (drawable(point)) {
          x_.hold(point.x);
          y_.hold(point.y);
        }
      }
    }
    for (const ChartRule& rule : chart.rules) {
      (rule.vertical ? x_ : y_).hold(rule.at);
    }
    x_.close();
    y_.close();
  }

  std::string body() {
    std::string text = legend();
    const double top = legend_height_ + 10.0;
    plot_ = {left, top, width - right, top + plot_height};
    x_.from = plot_.x0;
    x_.to = plot_.x1;
    y_.from = plot_.y1;
    y_.to = plot_.y0;
    text += axes() + rules() + series();
    return text;
  }

  double height() const { return plot_.y1 + bottom; }

 private:
  std::string legend() {
    std::string text;
    double x = left;
    double y = 16.0;
    for (const ChartSeries& series : chart_.series) {
      if (series.name.empty()) {
        continue;
      }
      const double entry = 44.0 + 7.0 * static_cast<double>(series.name.size());
      if (x + entry > width) {
        x = left;
        y += legend_row;
      }
      if (series.line) {
        text += fmt::format("<path class=\"c{} line{}\" d=\"M{:.1f} {:.1f}h24\"/>", series.colour,
                            series.dashed ? " dashed" : "", x, y);
      }
      if (series.marks) {
        text += mark_of(series, x + 12.0, y);
      }
      text += fmt::format("<text class=\"key\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x + 30.0,
                          y + 4.0, xml_escaped(series.name));
      x += entry;
    }
    legend_height_ = y + 10.0;
    return text;
  }

  std::string axes() {
    std::string text;
    for (const LogAxis::Tick& tick : x_.ticks()) {
      const double x = x_.at(tick.value);
      text += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>",
                          tick.labelled ? "grid" : "grid fine", x, plot_.y0, plot_.y1);
      if (tick.labelled) {
        text += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x,
                            plot_.y1 + 17.0, xml_escaped(chart_.x_tick(tick.value)));
      }
    }
    for (const LogAxis::Tick& tick : y_.ticks()) {
      const double y = y_.at(tick.value);
      text += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>",
                          tick.labelled ? "grid" : "grid fine", plot_.x0, y, plot_.x1);
      if (tick.labelled) {
        text += fmt::format("<text class=\"tick end\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                            plot_.x0 - 7.0, y + 4.0, xml_escaped(chart_.y_tick(tick.value)));
      }
    }
    const double middle = (plot_.y0 + plot_.y1) / 2.0;
    text += fmt::format(
        "<rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>\n"
        "<text class=\"axis\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n"
        "<text class=\"axis\" transform=\"translate(16 {:.1f}) rotate(-90)\">{}</text>\n",
        plot_.x0, plot_.y0, plot_.x1 - plot_.x0, plot_.y1 - plot_.y0, (plot_.x0 + plot_.x1) / 2.0,
        plot_.y1 + 42.0, xml_escaped(chart_.x_label), middle, xml_escaped(chart_.y_label));
    return text;
  }

  std::string rules() {
    std::string text;
    for (const ChartRule& rule : chart_.rules) {
      const double text_width = character * static_cast<double>(rule.label.size());
      Box label;
      if (rule.vertical) {
        const double x = x_.at(rule.at);
        text += fmt::format("<path class=\"c{} rule\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>", rule.colour,
                            x, plot_.y0, plot_.y1);
        label = {x + 4.0, plot_.y0 + 4.0, x + 4.0 + text_width, plot_.y0 + 4.0 + label_height};
        if (label.x1 > plot_.x1) {
          label = {x - 4.0 - text_width, label.y0, x - 4.0, label.y1};
        }
      } else {
        const double y = y_.at(rule.at);
        text += fmt::format("<path class=\"c{} rule\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", rule.colour,
                            plot_.x0, y, plot_.x1);
        label = {plot_.x0 + 6.0, y - 3.0 - label_height, plot_.x0 + 6.0 + text_width, y - 3.0};
      }
      while (std::any_of(taken_.begin(), taken_.end(),
                         [&](const Box& other) { return label.meets(other); })) {
        label.y0 += label_height + 2.0;
        label.y1 += label_height + 2.0;
      }
      taken_.push_back(label);
      text += fmt::format("<text class=\"c{} label\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                          rule.colour, label.x0, label.y1 - 3.0, xml_escaped(rule.label));
    }
    return text;
  }

  std::string series() {
    std::string text;
    for (const ChartSeries& series : chart_.series) {
      std::string line;
      for (const ChartPoint& point : series.points) {
        if (!drawable(point)) {
          continue;
        }
        const double x = x_.at(point.x);
        const double y = y_.at(point.y);
        line += fmt::format("{}{:.1f} {:.1f}", line.empty() ? "M" : "L", x, y);
        if (series.marks) {
          taken_.push_back({x - radius, y - radius, x + radius, y + radius});
        }
      }
      if (series.line && !line.empty()) {
        text += fmt::format("<path class=\"c{} line{}\" d=\"{}\"/>\n", series.colour,
                            series.dashed ? " dashed" : "", line);
      }
    }
    for (const ChartSeries& series : chart_.series) {
      for (const ChartPoint& point : series.points) {
        if (!drawable(point)) {
          continue;
        }
        const double x = x_.at(point.x);
        const double y = y_.at(point.y);
        if (series.marks) {
          text += fmt::format("<g><title>{}</title>{}</g>\n", xml_escaped(point.title),
                              mark_of(series, x, y));
        }
        if (point.label.empty()) {
          continue;
        }
        const double text_width = character * static_cast<double>(point.label.size());
        if (const auto place = place_label(x, y, text_width, plot_, taken_)) {
          taken_.push_back(*place);
          text += fmt::format("<text class=\"c{} label\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                              series.colour, place->x0, place->y1 - 3.0, xml_escaped(point.label));
        }
      }
    }
    return text;
  }

  const Chart& chart_;
  LogAxis x_;
  LogAxis y_;
  Box plot_;
  double legend_height_ = 0.0;
  std::vector<Box> taken_;  ///< by marks and labels
};

std::string svg_with(const Chart& chart, const std::string& attributes, const std::string& style) {
  Drawing drawing(chart);
  const std::string body = drawing.body();
  return fmt::format(
      "<svg{} class=\"chart\" role=\"img\" viewBox=\"0 0 {:.0f} {:.0f}\">\n<title>{}</title>\n"
      "{}{}</svg>\n",
      attributes, width, drawing.height(), xml_escaped(chart.title), style, body);
}

}  // namespace

std::string svg_of(const Chart& chart) { return svg_with(chart, "", ""); }

std::string svg_file(const Chart& chart) {
  return svg_with(chart, " xmlns=\"http://www.w3.org/2000/svg\"",
                  "<style>" + file_style() +
                      "</style>\n<rect class=\"ground\" width=\"100%\" height=\"100%\"/>\n");
}

std::string xml_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace palpate::bench
