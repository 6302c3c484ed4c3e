#include "chart_style.hpp"

#include <array>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

struct Colour {
  int red;
  int green;
  int blue;
};

constexpr std::array<Colour, 6> light_colours{{{0x00, 0x72, 0xb2},
                                               {0xc0, 0x4e, 0x00},
                                               {0x00, 0x80, 0x5f},
                                               {0xa3, 0x45, 0x7f},
                                               {0x8a, 0x6a, 0x00},
                                               {0x6b, 0x6b, 0x6b}}};

constexpr const char* common_rules = R"(
.chart { font-family: system-ui, 'DejaVu Sans', sans-serif; font-size: 12px; }
.chart text { fill: var(--ink); }
.chart .ground { fill: var(--ground); }
.chart .grid { stroke: var(--grid); fill: none; }
.chart .fine { stroke-opacity: 0.45; }
.chart .frame { stroke: var(--faint); fill: none; }
.chart .tick { text-anchor: middle; fill: var(--faint); }
.chart .end { text-anchor: end; }
.chart .axis { text-anchor: middle; font-size: 13px; }
.chart .label { font-size: 11px; stroke: none; }
.chart .line { fill: none; stroke-width: 1.8; }
.chart .rule { fill: none; stroke-width: 1.4; stroke-dasharray: 2 4; }
.chart .dashed { stroke-dasharray: 7 5; }
.chart path, .chart circle, .chart rect { stroke-width: 1.6; }
)";

/// What wears a colour's class, itself or in a group that does.
std::string rules_of_colour(std::size_t i, const std::string& colour, const std::string& pale) {
  std::string rules;
  const auto add = [&](const char* what, const std::string& declarations) {
    rules += fmt::format(".chart .c{0} {1}, .chart {1}.c{0} {{ {2} }}\n", i, what, declarations);
  };
  add(".line", fmt::format("stroke: {};", colour));
  add(".rule", fmt::format("stroke: {};", colour));
  add("text.label", fmt::format("fill: {};", colour));
  add(".solid", fmt::format("fill: {}; stroke: var(--ground); stroke-width: 1;", colour));
  add(".half", fmt::format("fill: {}; stroke: {};", pale, colour));
  add(".hollow", fmt::format("fill: var(--ground); stroke: {};", colour));
  return rules;
}

}  // namespace

std::string chart_style() {
  std::string style = R"(
:root { --ground: #ffffff; --ink: #1c1c1c; --faint: #6b6b6b; --grid: #dcdcdc;
  --c0: #0072b2; --c1: #c04e00; --c2: #00805f; --c3: #a3457f; --c4: #8a6a00; --c5: #6b6b6b; }
@media (prefers-color-scheme: dark) { :root { --ground: #15181c; --ink: #ececec; --faint: #a8a8a8;
  --grid: #353a41; --c0: #56b4e9; --c1: #f0873c; --c2: #2fc79a; --c3: #de8fc0; --c4: #e0b93a;
  --c5: #a8a8a8; } }
)";
  style += common_rules;
  for (std::size_t i = 0; i < light_colours.size(); ++i) {
    style += rules_of_colour(i, fmt::format("var(--c{})", i),
                             fmt::format("color-mix(in srgb, var(--c{}) 40%, var(--ground))", i));
  }
  return style;
}

std::string file_style() {
  std::string style = common_rules;
  for (std::size_t i = 0; i < light_colours.size(); ++i) {
    const Colour& colour = light_colours[i];
    const auto paler = [](int part) { return part * 2 / 5 + 255 * 3 / 5; };
    style += rules_of_colour(
        i, fmt::format("#{:02x}{:02x}{:02x}", colour.red, colour.green, colour.blue),
        fmt::format("#{:02x}{:02x}{:02x}", paler(colour.red), paler(colour.green),
                    paler(colour.blue)));
  }
  constexpr std::array<std::array<const char*, 2>, 4> plain{{{"var(--ground)", "#ffffff"},
                                                             {"var(--ink)", "#1c1c1c"},
                                                             {"var(--faint)", "#6b6b6b"},
                                                             {"var(--grid)", "#dcdcdc"}}};
  for (const auto& [variable, value] : plain) {
    for (std::size_t at = style.find(variable); at != std::string::npos;
         at = style.find(variable, at)) {
      style.replace(at, std::string_view(variable).size(), value);
    }
  }
  return style;
}

}  // namespace palpate::bench
