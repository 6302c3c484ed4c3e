#include "figures/identity_panel.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <fmt/format.h>

#include "figures/view.hpp"

namespace palpate {

namespace {

constexpr double row_px = 26.0;  ///< from label to label
constexpr double leader_px = 24.0;
constexpr std::size_t most_markers = 40;

struct Curve {
  std::string label;
  std::vector<double> probability;  ///< [touch]
  Colour colour = grey;

  /// Probability after the last touch; 0 where the belief has lost all its mass.
  double last() const {
    return probability.empty() || !std::isfinite(probability.back()) ? 0.0 : probability.back();
  }
};

/// Returns one curve per label, in the labels' order.
std::vector<Curve> curves_of(const std::vector<std::string>& labels,
                             const std::vector<std::vector<double>>& identity) {
  std::vector<Curve> curves;
  std::unordered_map<std::string, std::size_t> of_label;
  for (std::size_t object = 0; object < labels.size(); ++object) {
    const auto [known, is_new] = of_label.emplace(labels[object], curves.size());
    if (is_new) {
      curves.push_back({labels[object], std::vector<double>(identity.size(), 0.0)});
    }
    Curve& curve = curves[known->second];
    for (std::size_t touch = 0; touch < identity.size(); ++touch) {
      curve.probability[touch] += identity[touch][object];
    }
  }
  return curves;
}

/// Colours the curves and moves the grey ones to the end. Returns how many are coloured. Where the
/// colours suffice for all, an object has the same colour on every sheet.
std::size_t colour_curves(std::vector<Curve>& curves) {
  const bool enough = curves.size() <= series_colours;
  if (!enough) {
    std::ranges::stable_sort(curves, std::ranges::greater{}, &Curve::last);
  }
  // One colour less, since the others share a label.
  const std::size_t coloured = enough ? curves.size() : series_colours - 1;
  for (std::size_t k = 0; k < coloured; ++k) {
    curves[k].colour = series(k);
  }
  return coloured;
}

void draw_curve(Canvas& canvas, const View& view, const Curve& curve, double width_px) {
  std::vector<glm::dvec2> points;
  for (std::size_t touch = 0; touch < curve.probability.size(); ++touch) {
    if (std::isfinite(curve.probability[touch])) {
      points.push_back(view.pixel({static_cast<double>(touch + 1), curve.probability[touch]}));
    }
  }
  canvas.line(points, {.colour = curve.colour, .width_px = width_px});
  if (points.size() <= most_markers) {
    for (const glm::dvec2& p : points) {
      canvas.disc(p, 2.0 * width_px, curve.colour);
    }
  }
}

struct Label {
  std::string text;
  double probability = 0.0;
  Colour colour;
  double end_px = 0.0;  ///< where its curve ends
  double row_px = 0.0;  ///< where it is written
};

/// Moves the labels apart, each as near to its curve's end as the others allow.
void spread(std::vector<Label>& labels, double bottom_px) {
  std::ranges::stable_sort(labels, {}, &Label::end_px);
  for (std::size_t k = 0; k < labels.size(); ++k) {
    labels[k].row_px = labels[k].end_px;
    if (k > 0) {
      labels[k].row_px = std::max(labels[k].row_px, labels[k - 1].row_px + row_px);
    }
  }
  double limit = bottom_px;
  for (auto label = labels.rbegin(); label != labels.rend(); ++label, limit -= row_px) {
    label->row_px = std::min(label->row_px, limit);
  }
}

void draw_labels(Canvas& canvas, const Box& plot, std::vector<Label> labels) {
  spread(labels, plot.bottom());
  const double left = plot.right() + leader_px + 6.0;
  const double percent_px = canvas.text_width("100.0 %", body) + 16.0;
  const double room = plot.right() + identity_labels_px - left - percent_px;
  double widest = 0.0;
  for (Label& label : labels) {
    label.text = canvas.fit(label.text, room, body);
    widest = std::max(widest, canvas.text_width(label.text, body));
  }
  for (const Label& label : labels) {
    canvas.segment({plot.right() + 3.0, label.end_px}, {plot.right() + leader_px, label.row_px},
                   {.colour = label.colour, .width_px = 1.5});
    const double baseline = label.row_px + 7.0;
    canvas.text(label.text, {left, baseline}, body, Align::left, label.colour);
    canvas.text(fmt::format("{:.1f} %", 100.0 * label.probability),
                {left + widest + percent_px, baseline}, body, Align::right, label.colour);
  }
}

}  // namespace

void draw_identity(Canvas& canvas, const Box& plot, const std::vector<std::string>& labels,
                   const std::vector<std::vector<double>>& identity) {
  std::vector<Curve> curves = curves_of(labels, identity);
  const std::size_t coloured = colour_curves(curves);

  const double touches = static_cast<double>(std::max<std::size_t>(identity.size(), 1));
  // The curves' ends stay clear of the frame.
  const View view{.box = plot, .lower = {0.5, -0.03}, .upper = {touches + 0.5, 1.03}};
  draw_axes(canvas, view, even_ticks(view.lower.x, view.upper.x, 10, 1.0), even_ticks(0.0, 1.0, 5),
            "touches", "probability");
  for (std::size_t k = curves.size(); k-- > 0;) {
    draw_curve(canvas, view, curves[k], k < coloured ? 3.0 : 1.5);
  }

  std::vector<Label> rows;
  const auto add = [&](const std::string& text, double probability, const Curve& curve) {
    rows.push_back({text, probability, curve.colour, view.pixel({0.0, curve.last()}).y});
  };
  for (std::size_t k = 0; k < coloured; ++k) {
    add(curves[k].label, curves[k].last(), curves[k]);
  }
  if (coloured < curves.size()) {
    double others = 0.0;
    for (std::size_t k = coloured; k < curves.size(); ++k) {
      others += curves[k].last();
    }
    add(fmt::format("{} others", curves.size() - coloured), others, curves[coloured]);
  }
  draw_labels(canvas, plot, std::move(rows));
}

}  // namespace palpate
