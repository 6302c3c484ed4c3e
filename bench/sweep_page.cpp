#include "sweep_page.hpp"

#include <cctype>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "pose_window.hpp"
#include "sweep_measurements.hpp"
#include "sweep_page_template.hpp"
#include "trial_errors.hpp"

namespace palpate::bench {

namespace {

/// Text as it may stand in XML, between tags or in quotes.
std::string xml_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    escaped += c == '&'   ? "&amp;"
               : c == '<' ? "&lt;"
               : c == '>' ? "&gt;"
               : c == '"' ? "&quot;"
                          : std::string(1, c);
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
std::string figure_of(const Chart& chart) {
  const ChartPicture picture = draw_chart(chart, PictureFormat::svg);
  std::string spots;
  for (const ChartSpot& spot : picture.spots) {
    spots +=
        fmt::format("<circle cx=\"{:.0f}\" cy=\"{:.0f}\" r=\"11\"><title>{}</title></circle>\n",
                    spot.at_px.x, spot.at_px.y, xml_escaped(spot.title));
  }
  return fmt::format(
      "<div class=\"chart\"><img alt=\"{} against {}\" src=\"data:image/svg+xml,{}\"/>\n"
      "<svg viewBox=\"0 0 {} {}\">\n{}</svg></div>",
      xml_escaped(chart.y.label), xml_escaped(chart.x.label), url_escaped(picture.bytes),
      picture.width_px, picture.height_px, spots);
}

/// What a column is sorted by: a number, the mean of a record, or the text.
std::string sort_key(const Json& value, const std::string& text) {
  return value.is_null()     ? "inf"
         : value.is_number() ? fmt::format("{:.9g}", value.get<double>())
         : value.is_object() ? fmt::format("{:.9g}", value.at("mean").get<double>())
                             : text;
}

std::string table(Columns columns, const Json& records) {
  std::string html = "<div class=\"wide\"><table>\n<thead><tr>";
  for (const Column& column : columns) {
    html += fmt::format("<th scope=\"col\">{}</th>", xml_escaped(column.head));
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const Json& record : records) {
    html += "<tr>";
    const std::vector<std::string> texts = texts_of(columns, record, "–");
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const Json value = field_of(record, columns[i].field);
      const std::string text = xml_escaped(texts[i]);
      html += fmt::format("<td{} data-value=\"{}\">{}</td>",
                          value.is_boolean() ? fmt::format(" class=\"{}\"", text) : "",
                          sort_key(value, text), text);
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

/// The page's template with a part in the place of every {{name}}.
std::string filled(const std::map<std::string, std::string>& parts) {
  std::string html;
  std::string_view rest = page_template;
  for (std::size_t begin = 0; (begin = rest.find("{{")) != rest.npos;) {
    const std::size_t end = rest.find("}}", begin);
    html += rest.substr(0, begin);
    html += parts.at(std::string(rest.substr(begin + 2, end - begin - 2)));
    rest.remove_prefix(end + 2);
  }
  return html.append(rest);
}

}  // namespace

std::string page_of(const Json& document) {
  const auto text = [&](const char* field) { return xml_escaped(plain_text(document.at(field))); };
  std::map<std::string, std::string> parts{
      {"trials", text("trials")},
      {"limit trials", plain_text(document.at("limits").front().at("error_mm").at("trials"))},
      {"windows", text("windows")},
      {"sampled bins", fmt::format("{}", sampled_bins)},
      {"least gain", fmt::format("{:.0f}", 100.0 * least_gain)},
      {"window reach", fmt::format("{}", window_reach_mm)},
      {"steps", table(step_columns(), steps_of(document))},
      {"limits", table(limit_columns(), document.at("limits"))},
      {"runs", table(run_columns(), document.at("points"))},
      {"precisions", table(precision_columns(), document.at("precisions"))},
      {"bounds", table(bounds_columns(), document.at("bounds"))},
      {"auto rule", xml_escaped(plain_text(document.at("auto_rule").at("sentence")))}};
  for (const char* fact :
       {"device", "host threads", "compiler", "data", "date", "command line", "seconds in all"}) {
    parts["facts"] += fmt::format("<dt>{}</dt><dd>{}</dd>\n", fact, text(fact));
  }
  for (const Json& knee : document.at("knees")) {
    parts["knees"] += fmt::format("<li>{}</li>\n", xml_escaped(knee.at("sentence")));
  }
  const Json& verdicts = document.at("verdicts");
  parts["goals"] = verdicts.empty() ? "" : "<h2>Goals</h2>\n" + table(verdict_columns(), verdicts);
  const std::vector<Chart> charts = charts_of(document);
  for (std::size_t i = 0; i < charts.size(); ++i) {
    parts[chart_names[i]] = figure_of(charts[i]);
  }
  return filled(parts);
}

}  // namespace palpate::bench
