#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "chart.hpp"
#include "sweep_result.hpp"
#include "sweep_words.hpp"

namespace palpate::bench {

namespace {

// Well-formed XML, too: no entity, "<" or "&" in the script.
constexpr const char* sort_script = R"(
document.querySelectorAll("th").forEach(function (head) {
  head.addEventListener("click", function () {
    var body = head.closest("table").tBodies[0];
    var column = head.cellIndex;
    var sign = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    var key = function (row) { return row.cells[column].dataset.value; };
    var rows = Array.from(body.rows);
    rows.sort(function (a, b) {
      var x = Number(key(a)), y = Number(key(b));
      return sign * (isNaN(x) || isNaN(y) ? key(a).localeCompare(key(b)) : x - y);
    });
    head.parentNode.querySelectorAll("th").forEach(function (th) {
      th.removeAttribute("aria-sort");
    });
    head.setAttribute("aria-sort", sign === 1 ? "ascending" : "descending");
    rows.forEach(function (row) { body.appendChild(row); });
  });
});
)";

constexpr const char* page_style = R"(
:root { --ground: #ffffff; --ink: #1c1c1c; --faint: #6b6b6b; --grid: #dcdcdc;
  --good: #00805f; --bad: #c04e00; }
@media (prefers-color-scheme: dark) { :root { --ground: #15181c; --ink: #ececec; --faint: #a8a8a8;
  --grid: #353a41; --good: #2fc79a; --bad: #f0873c; } }
body { margin: 2rem auto; max-width: 70rem; padding: 0 1rem; background: var(--ground);
  color: var(--ink); font: 15px/1.5 system-ui, 'DejaVu Sans', sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 0.4rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 0.4rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 1.2rem; margin: 0.6rem 0; }
dt { color: var(--faint); }
dd { margin: 0; overflow-wrap: anywhere; }
figure { margin: 0; }
figcaption, .note { color: var(--faint); font-size: 0.9em; }
.chart { position: relative; background: #ffffff; border-radius: 6px; }
.chart img { width: 100%; display: block; }
.chart svg { position: absolute; inset: 0; width: 100%; height: 100%; }
.chart circle { fill: transparent; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 12px; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2rem 0.4rem; text-align: right; white-space: nowrap; }
thead th { border-bottom: 1.5px solid var(--faint); cursor: pointer; vertical-align: bottom;
  white-space: normal; }
th[aria-sort=ascending]::after { content: ' \2191'; }
th[aria-sort=descending]::after { content: ' \2193'; }
tbody tr { border-bottom: 1px solid var(--grid); }
.text { text-align: left; }
.yes { color: var(--good); font-weight: 600; } .no { color: var(--bad); font-weight: 600; }
)";

/// Text as it may stand in XML, between tags or in quotes.
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

/// Bytes as they may stand in a URL.
std::string url_escaped(const std::string& bytes) {
  std::string escaped;
  for (const char c : bytes) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 ||
                       std::string_view(" -.,;:/()").find(c) != std::string_view::npos;
    escaped += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return escaped;
}

/// The chart as a picture in the page. Invisible discs over its marks show their titles under the
/// pointer.
std::string figure_of(const NamedChart& chart) {
  const ChartPicture picture = draw_chart(chart.chart, PictureFormat::svg);
  std::string spots;
  for (const ChartSpot& spot : picture.spots) {
    spots +=
        fmt::format("<circle cx=\"{:.0f}\" cy=\"{:.0f}\" r=\"11\"><title>{}</title></circle>\n",
                    spot.at_px.x, spot.at_px.y, xml_escaped(spot.title));
  }
  return fmt::format(
      "<h2>{0}</h2>\n<figure>\n<div class=\"chart\"><img alt=\"{0}\" "
      "src=\"data:image/svg+xml,{1}\"/>\n<svg viewBox=\"0 0 {2} {3}\">\n{4}</svg></div>\n"
      "<figcaption>{5}</figcaption>\n</figure>\n",
      xml_escaped(chart.title), url_escaped(picture.bytes), picture.width_px, picture.height_px,
      spots, xml_escaped(chart.caption));
}

/// A table's cell, sorted by `value`.
std::string cell(const std::string& text, double value) {
  return fmt::format("<td data-value=\"{:.9g}\">{}</td>", value, text);
}
std::string cell(const std::string& text) {
  const std::string escaped = xml_escaped(text);
  return fmt::format("<td class=\"text\" data-value=\"{}\">{}</td>", escaped, escaped);
}
std::string cell(const std::optional<double>& value, const char* format) {
  return value ? cell(fmt::format(fmt::runtime(format), *value), *value)
               : "<td data-value=\"inf\">–</td>";
}
std::string cell(std::int64_t count) {
  return cell(fmt::format("{}", count), static_cast<double>(count));
}

std::string mean(const std::optional<ErrorsOverTrials>& errors) {
  return errors ? cell(mean_text(errors), errors->mean_mm) : cell(std::nullopt, "");
}

/// Mean with standard error, median and 95th percentile.
std::string errors(const SweepPoint& point, PoseKind kind) {
  const std::optional<ErrorsOverTrials> over = errors_over(point.errors, kind);
  return mean(over) + cell(over ? std::optional(over->median_mm) : std::nullopt, "{:.3f}") +
         cell(over ? over->p95_mm : std::nullopt, "{:.3f}");
}

std::string row(const SweepPoint& point) {
  const auto mib = static_cast<double>(point.device_bytes) / (1 << 20);
  const std::optional<ErrorsOverTrials> located = errors_over(point.errors, PoseKind::mode);
  const std::string bins = point.filter == "histogram" ? fmt::format("{}x{}x{}", point.bins[0],
                                                                     point.bins[1], point.bins[2])
                                                       : std::string("–");
  std::string text = "<tr>";
  text += cell(point.filter);
  text += cell(fmt::format("{}", point.cell_mm), point.cell_mm);
  text += cell(point.count);
  text += cell(bins);
  text += cell(static_cast<std::int64_t>(point.full_trials));
  text += cell(seconds_text(point.seconds_touch), point.seconds_touch);
  text += cell(seconds_text(point.seconds_unknown), point.seconds_unknown);
  text += point.seconds_refine ? cell(seconds_text(*point.seconds_refine), *point.seconds_refine)
                               : cell(std::nullopt, "");
  text += cell(fmt::format("{:.3g}", mib), mib);
  text += cell(fmt::format("{:.1f}", 100.0 * point.accuracy), point.accuracy);
  text += cell(fmt::format("{:.3f}", point.calibration_error), point.calibration_error);
  text += cell(fmt::format("{} of {}{}", located ? located->trials : 0, point.errors.size(),
                           point.window ? ", windows" : ""),
               located ? located->trials : 0);
  text += errors(point, PoseKind::mode);
  text += errors(point, PoseKind::refined);
  text += cell(point.nearest_bin_mm, "{:.3f}");
  text += cell(point.deviation.largest, "{:.1e}") + cell(point.deviation.rms, "{:.1e}");
  text += cell(point.path);
  return text + "</tr>\n";
}

std::string row(const Precision& precision) {
  return "<tr>" + cell(precision.path) + cell(precision.count) +
         cell(precision.nanoseconds, "{:.3g}") + cell(precision.deviation.largest, "{:.1e}") +
         cell(precision.deviation.rms, "{:.1e}") + "</tr>\n";
}

std::string row(const SweepResult& result, const Limit& limit) {
  return "<tr>" + cell(limit.name) + cell(static_cast<std::int64_t>(limit.elements)) +
         cell(limit.count) + mean(errors_over(limit.errors, PoseKind::mode)) +
         mean(errors_over(limit.errors, PoseKind::refined)) + cell(against_text(result, limit)) +
         cell(difference_text(result, limit, PoseKind::mode)) +
         cell(difference_text(result, limit, PoseKind::refined)) + "</tr>\n";
}

std::string table(const std::vector<std::string>& heads, const std::string& rows) {
  std::string text = "<div class=\"wide\"><table>\n<thead><tr>";
  for (const std::string& head : heads) {
    text += fmt::format("<th scope=\"col\">{}</th>", head);
  }
  return text + "</tr></thead>\n<tbody>\n" + rows + "</tbody></table></div>\n";
}

std::string run_table(const SweepResult& result) {
  std::string rows;
  for (const SweepPoint& point : result.points) {
    rows += row(point);
  }
  return table({"filter",
                "cells, mm",
                "bins per object, or particles",
                "bins",
                "trials in full",
                "per touch",
                "per unknown",
                "refined pose",
                "device memory, MiB",
                "right, % of trials in full",
                "calibration error, all touches of the trials in full pooled",
                "trials located",
                "mode: mean ± standard error, mm",
                "median",
                "95 %",
                "refined: mean ± standard error, mm",
                "median",
                "95 %",
                "nearest bin, mm",
                fmt::format("largest deviation of {} bins an object, or as many particles, after "
                            "one touch, nats",
                            sampled_bins),
                "RMS",
                "path"},
               rows);
}

std::string precision_table(const SweepResult& result) {
  std::string rows;
  for (const Precision& precision : result.precisions) {
    rows += row(precision);
  }
  return table(
      {"path", "bins per object", "ns per pose, element and touch",
       fmt::format("largest deviation of {} bins an object after one touch, nats", sampled_bins),
       "RMS"},
      rows);
}

std::string limit_table(const SweepResult& result) {
  std::string rows;
  for (const Limit& limit : result.limits) {
    rows += row(result, limit);
  }
  return table({"what is otherwise", "elements", "bins per object",
                "mode: mean ± standard error, mm", "refined: mean ± standard error, mm", "against",
                "mode: difference, mm", "refined: difference, mm"},
               rows);
}

std::string verdicts_of(const SweepResult& result) {
  std::string text = "<ul>\n";
  for (const Measurement& verdict : result.verdicts) {
    text += fmt::format("<li>{}: <span class=\"{}\">{}</span>, {:.3f} {} (at most {} {})</li>\n",
                        xml_escaped(verdict.name), verdict.reached() ? "yes" : "no",
                        verdict.reached() ? "reached" : "not reached", verdict.value, verdict.unit,
                        verdict.goal->value, verdict.unit);
  }
  return text + "</ul>\n";
}

}  // namespace

std::string page_of(const SweepResult& result, const nlohmann::ordered_json& facts) {
  std::string text = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>Palpate: speed against error</title>\n<style>{}</style>\n</head>\n<body>\n"
      "<h1>Palpate: speed against error</h1>\n<dl>\n",
      page_style);
  for (const auto& [name, value] : facts.items()) {
    text += fmt::format("<dt>{}</dt><dd>{}</dd>\n", xml_escaped(name),
                        xml_escaped(value.is_string() ? value.get<std::string>() : value.dump()));
  }
  text += "</dl>\n";
  if (!result.verdicts.empty()) {
    text += "<h2>Verdicts</h2>\n" + verdicts_of(result);
  }
  for (const NamedChart& chart : charts_of(result)) {
    text += figure_of(chart);
  }
  text += "<h2>Where more bins stop helping</h2>\n<ul>\n";
  for (const CellFinding& finding : result.findings) {
    text += fmt::format("<li>{}</li>\n", xml_escaped(finding.sentence));
  }
  text += fmt::format(
      "</ul>\n<p class=\"note\">Bins suffice where all trials are located and no finer lattice "
      "lowers the "
      "mean error by more than {:.0f} % and by more than two standard errors of the paired "
      "differences. ± is a "
      "standard error.</p>\n",
      100.0 * least_gain);
  text += fmt::format(
      "<h2>What bounds the error</h2>\n<p class=\"note\">One thing otherwise at a time, {} trials "
      "in windows, which say nothing of how well the object and its neighbourhood are found; "
      "differences are paired by trial, above 0 where it errs more.</p>\n",
      result.limits.front().errors.size());
  text += limit_table(result);
  text += "<h2>All runs</h2>\n<p class=\"note\">Click on a head to sort.</p>\n" + run_table(result);
  text += fmt::format(
      "<p class=\"note\">A run with fewer trials in full than located has its errors from windows: "
      "the bins of the same lattice within {} mm of the truth, by the pose error, of the true "
      "object's map alone. A bin's likelihood does not depend on the others, so that mode and "
      "refined pose are those of the full posterior wherever that has its mode there, as it has in "
      "the trials in full. {}</p>\n",
      window_reach_mm, xml_escaped(window_sentence(result)));
  text += "<h2>All ways to evaluate the likelihood</h2>\n" + precision_table(result);
  return text + fmt::format("<script>{}</script>\n</body>\n</html>\n", sort_script);
}

}  // namespace palpate::bench
