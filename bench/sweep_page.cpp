#include <string>
#include <vector>

#include <fmt/format.h>

#include "chart_style.hpp"
#include "svg_chart.hpp"
#include "sweep_findings.hpp"
#include "sweep_result.hpp"

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
body { margin: 2rem auto; max-width: 70rem; padding: 0 1rem; background: var(--ground);
  color: var(--ink); font: 15px/1.5 system-ui, 'DejaVu Sans', sans-serif; }
h1 { font-size: 1.6rem; margin: 0 0 0.4rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 0.4rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.1rem 1.2rem; margin: 0.6rem 0; }
dt { color: var(--faint); }
dd { margin: 0; overflow-wrap: anywhere; }
figure { margin: 0; }
figcaption, .note { color: var(--faint); font-size: 0.9em; }
svg { width: 100%; height: auto; display: block; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 12px; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2rem 0.4rem; text-align: right; white-space: nowrap; }
thead th { border-bottom: 1.5px solid var(--faint); cursor: pointer; vertical-align: bottom;
  white-space: normal; }
th[aria-sort=ascending]::after { content: ' \2191'; }
th[aria-sort=descending]::after { content: ' \2193'; }
tbody tr { border-bottom: 1px solid var(--grid); }
.text { text-align: left; }
.yes { color: var(--c2); font-weight: 600; } .no { color: var(--c1); font-weight: 600; }
)";

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
               : "<td data-value=\"inf\">-</td>";
}

std::string errors(const std::optional<ErrorSummary>& error) {
  const auto value = [&](double ErrorSummary::*part) {
    return error ? std::optional((*error).*part) : std::nullopt;
  };
  return cell(value(&ErrorSummary::mean_mm), "{:.3f}") +
         cell(value(&ErrorSummary::median_mm), "{:.3f}") +
         cell(value(&ErrorSummary::p95_mm), "{:.3f}");
}

std::string row(const SweepPoint& point) {
  const auto mib = static_cast<double>(point.device_bytes) / (1 << 20);
  const auto largest = point.deviation ? std::optional(point.deviation->largest) : std::nullopt;
  const auto rms = point.deviation ? std::optional(point.deviation->rms) : std::nullopt;
  const std::string bins = point.filter == "histogram" ? fmt::format("{}x{}x{}", point.bins[0],
                                                                     point.bins[1], point.bins[2])
                                                       : std::string("-");
  std::string text = "<tr>";
  text += cell(point.filter);
  text += cell(fmt::format("{}", point.cell_mm), point.cell_mm);
  text += cell(fmt::format("{}", point.count), static_cast<double>(point.count));
  text += cell(bins);
  text += cell(fmt::format("{}", point.scores.size()), static_cast<double>(point.scores.size()));
  text += cell(seconds_text(point.seconds_touch), point.seconds_touch);
  text += cell(seconds_text(point.seconds_unknown), point.seconds_unknown);
  text += cell(fmt::format("{:.3g}", mib), mib);
  text += cell(fmt::format("{:.1f}", 100.0 * point.last.accuracy), point.last.accuracy);
  text += errors(point.last.error);
  text += errors(point.last.refined_error);
  text += cell(point.nearest_bin_mm, "{:.3f}");
  text += cell(fmt::format("{:.3f}", point.calibration_error), point.calibration_error);
  text += cell(largest, "{:.1e}") + cell(rms, "{:.1e}");
  text += cell(point.path);
  return text + "</tr>\n";
}

std::string table_of(const SweepResult& result) {
  std::string text = "<div class=\"wide\"><table>\n<thead><tr>";
  for (const char* head : {"filter",
                           "cells, mm",
                           "bins per object, or particles",
                           "bins",
                           "trials",
                           "per touch",
                           "per unknown",
                           "device MiB",
                           "right, %",
                           "mode mean, mm",
                           "median",
                           "95 %",
                           "refined mean, mm",
                           "median",
                           "95 %",
                           "nearest bin, mm",
                           "calibration error",
                           "largest deviation, nats per touch",
                           "RMS",
                           "path"}) {
    text += fmt::format("<th scope=\"col\">{}</th>", head);
  }
  text += "</tr></thead>\n<tbody>\n";
  for (const SweepPoint& point : result.points) {
    text += row(point);
  }
  return text + "</tbody></table></div>\n";
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
      "<title>Palpate: speed against error</title>\n<style>{}{}</style>\n</head>\n<body>\n"
      "<h1>Palpate: speed against error</h1>\n<dl>\n",
      chart_style(), page_style);
  for (const auto& [name, value] : facts.items()) {
    text += fmt::format("<dt>{}</dt><dd>{}</dd>\n", xml_escaped(name),
                        xml_escaped(value.is_string() ? value.get<std::string>() : value.dump()));
  }
  text += "</dl>\n";
  if (!result.verdicts.empty()) {
    text += "<h2>Verdicts</h2>\n" + verdicts_of(result);
  }
  for (const NamedChart& chart : charts_of(result)) {
    text += fmt::format("<h2>{}</h2>\n<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n",
                        xml_escaped(chart.title), chart.svg, xml_escaped(chart.caption));
  }
  text += "<h2>Where more bins stop helping</h2>\n<ul>\n";
  for (const CellFinding& finding : result.findings) {
    text += fmt::format("<li>{}</li>\n", xml_escaped(finding.sentence));
  }
  text += fmt::format(
      "</ul>\n<p class=\"note\">Bins suffice where no finer lattice lowers the mean error by more "
      "than {:.0f} %, over the trials that both had.</p>\n",
      100.0 * (1.0 - 1.0 / (1.0 + knee_loss)));
  text += "<h2>All runs</h2>\n<p class=\"note\">Click on a head to sort.</p>\n" + table_of(result);
  return text + fmt::format("<script>{}</script>\n</body>\n</html>\n", sort_script);
}

}  // namespace palpate::bench
