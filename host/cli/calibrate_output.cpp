#include "cli/calibrate_output.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "cli/evaluate_output.hpp"
#include "cli/options.hpp"
#include "cli/text_table.hpp"
#include "figures/chart.hpp"
#include "figures/palette.hpp"
#include "figures/ticks.hpp"
#include "learning/level_counts.hpp"
#include "model/option_words.hpp"
#include "recognition/misfit.hpp"

namespace palpate::cli {

namespace {

std::string short_number(double value) { return fmt::format("{:.3g}", value); }

std::string values_table(const SensorCalibration& calibration) {
  const LearnedSensor& sensor = calibration.sensor;
  const LearnedSensor initial;
  const bool raw = sensor.pressure_unit == "raw";
  const std::string& unit = sensor.pressure_unit;
  TextTable table({{"", false}, {"default", true}, {"learned", true}});
  const auto add = [&](const std::string& name, const std::string& usual, double learned) {
    table.add({name, usual, short_number(learned)});
  };
  add("noise floor, " + unit, "", sensor.noise);
  add("contact threshold, " + unit, raw ? "" : short_number(initial.classifier.threshold),
      sensor.classifier.threshold);
  add("ratio", short_number(initial.classifier.ratio), sensor.classifier.ratio);
  if (sensor.psf_mm) {
    add("point spread, mm", "1", *sensor.psf_mm);
  }
  add("spread of maps, mm", short_number(initial.spread_mm), sensor.spread_mm);
  add("gamma of Eq. 7", short_number(initial.gamma), sensor.gamma);
  add("prior", "", sensor.prior);
  if (calibration.touch_sd_fitted) {
    add("touch-sd, mm", "0", sensor.touch_sd.mm);
    add("touch-sd, degrees", "0", degrees(sensor.touch_sd.rad));
  }
  table.add({"levels of readings", "2", fmt::format("{}", sensor.table->levels())});
  add("temperature", "1", sensor.temperature);
  if (calibration.groups) {
    add("more for every further touch", "0", sensor.temperature_growth);
  }
  if (sensor.features) {
    add("weight of area, force and peak", "0", sensor.features->weight);
  }
  if (sensor.fit_scale) {
    table.add({"fit of learned objects, z", "0 +- 1",
               fmt::format("{:.2g} +- {:.2g}", sensor.fit_scale->mean, sensor.fit_scale->sd)});
    if (const auto& learned = sensor.fit_scale->stranger_sd) {
      table.add({"of strangers, for every further touch",
                 fmt::format("+- {:.2g} more", usual_stranger_sd),
                 fmt::format("+- {:.2g} more", *learned)});
    }
  }
  return table.text();
}

std::string scores_table(const std::string& title, const char* records, const Scores& before,
                         const Scores& learned, const Scores& after) {
  TextTable table({{title, false}, {"Eq. 7", true}, {"table", true}, {"table, tempered", true}});
  table.add({records, fmt::format("{}", before.records), fmt::format("{}", learned.records),
             fmt::format("{}", after.records)});
  add_score_rows(table, {&before, &learned, &after});
  return table.text();
}

std::string scores_tables(const SensorCalibration& calibration) {
  std::string text = scores_table("cross-validation", "touches", *calibration.before,
                                  *calibration.table, *calibration.after);
  if (const auto& groups = calibration.groups) {
    text += "\n" + scores_table(fmt::format("{} touches together", groups->touches), "unknowns",
                                groups->before, groups->table, groups->after);
  }
  return text;
}

std::string kind_name(const TableKind& kind) {
  return fmt::format("{} levels over {}", kind.levels,
                     kind.layer == MapLayer::log_odds ? "log odds" : "the mean pressure");
}

/// The value that a layer of mean levels has for a pressure.
double value_of(double pressure, const ReadingLayer& layer) {
  const double share =
      std::log1p(pressure / layer.unit_level) / std::log1p(layer.full_level / layer.unit_level);
  return ReadingLayer::largest_value * (2.0 * share - 1.0);
}

/// Distances to the nearest cell that a touch sensed, then round pressures or log odds.
std::vector<Tick> ticks_of(const ReadingLayer& layer) {
  const std::string near = fmt::format("≤{:.2g}", layer.near_mm);
  const std::string midway = fmt::format("≤{:.2g}", layer.far_mm);
  std::vector<Tick> ticks{{ReadingLayer::near_occupied, near},
                          {ReadingLayer::midway_occupied, midway},
                          {ReadingLayer::beyond, fmt::format(">{:.2g}", layer.far_mm)},
                          {ReadingLayer::midway_free, midway},
                          {ReadingLayer::near_free, near}};
  if (layer.of == MapLayer::log_odds) {
    std::ranges::copy(even_ticks(-ReadingLayer::largest_value, ReadingLayer::largest_value, 8),
                      std::back_inserter(ticks));
    return ticks;
  }
  constexpr double apart = 1.5;  // of the axis' 24, for labels of five digits
  ticks.push_back({-ReadingLayer::largest_value, "0"});
  for (double decade = std::pow(10.0, std::floor(std::log10(layer.unit_level)));
       decade <= layer.full_level; decade *= 10.0) {
    for (const double pressure : {decade, 2.0 * decade, 5.0 * decade}) {
      const double value = value_of(pressure, layer);
      if (value >= ticks.back().value + apart && value <= ReadingLayer::largest_value) {
        ticks.push_back({value, short_number(pressure)});
      }
    }
  }
  return ticks;
}

std::string level_name(std::size_t level, const LearnedTable& table, const std::string& unit) {
  if (level == 0) {
    return "No Contact";
  }
  const std::vector<double>& edges = table.level_edges;
  if (edges.empty()) {
    return "In Contact";
  }
  if (level == 1) {
    return fmt::format("up to {:.3g} {}", edges.front(), unit);
  }
  return level == edges.size() + 1
             ? fmt::format("above {:.3g} {}", edges.back(), unit)
             : fmt::format("{:.3g} to {:.3g} {}", edges[level - 2], edges[level - 1], unit);
}

/// Whether the table has learned anything at a node. Where it has not, Eq. 7 takes all levels In
/// Contact as equally likely; with one such level, that cannot be told.
bool is_learned(const std::vector<double>& table, int node) {
  const auto at = [&](std::size_t level) {
    return table[level * ReadingLayer::nodes + static_cast<std::size_t>(node)];
  };
  const std::size_t levels = table.size() / ReadingLayer::nodes;
  for (std::size_t level = 2; level < levels; ++level) {
    if (std::abs(at(level) - at(1)) > 1e-9) {
      return true;
    }
  }
  return levels == 2;
}

/// The nodes of cells that were sensed, or of those that were not.
std::vector<int> nodes_of(bool sensed) {
  std::vector<int> nodes;
  for (int node = 0; node < ReadingLayer::nodes; ++node) {
    const double value = LevelCounts::value_at(node);
    const bool unsensed_value =
        value == ReadingLayer::near_free || value == ReadingLayer::near_occupied ||
        value == ReadingLayer::midway_free || value == ReadingLayer::midway_occupied ||
        value == ReadingLayer::beyond;
    if (sensed ? value >= -ReadingLayer::largest_value : unsensed_value) {
      nodes.push_back(node);
    }
  }
  return nodes;
}

/// Probabilities of a level at the nodes.
std::vector<ChartPoint> points_of(const std::vector<double>& table, std::size_t level,
                                  std::span<const int> nodes) {
  std::vector<ChartPoint> points;
  for (const int node : nodes) {
    points.push_back(
        {.x = LevelCounts::value_at(node),
         .y = std::exp(table[level * ReadingLayer::nodes + static_cast<std::size_t>(node)])});
  }
  return points;
}

}  // namespace

std::string unlearned_strangers(const LearnedSensor& sensor) {
  const bool known_poses = sensor.bins.has_value();
  if (!known_poses || !sensor.fit_scale || sensor.fit_scale->stranger_sd) {
    return "";
  }
  return "\"(none)\" goes by a figure of Palpate's own for how badly strangers fit; to learn it, "
         "give 15 touches or more of each of three objects";
}

std::string calibration_text(const SensorCalibration& calibration, std::size_t touches) {
  std::string text = fmt::format("{} touches, {}\n\n", touches,
                                 count_of(calibration.objects, "object", "objects"));
  text += values_table(calibration);
  if (calibration.before) {
    text += "\n" + scores_tables(calibration);
  }
  if (calibration.tried.size() > 1) {
    text += "tables tried, with their log-loss:";
    for (const TriedTable& table : calibration.tried) {
      text += fmt::format("{} {}, {:.3f}", &table == calibration.tried.data() ? "" : ";",
                          kind_name(table.kind), table.log_loss);
    }
    text += fmt::format("; kept: {}\n", kind_name({calibration.sensor.table->layer.of,
                                                   calibration.sensor.table->levels()}));
  }
  if (calibration.area_under_curve) {
    text +=
        fmt::format("area under the curve of touches of known against left-out objects: {:.3f}\n",
                    *calibration.area_under_curve);
  }
  if (const std::string words = unlearned_strangers(calibration.sensor); !words.empty()) {
    text += words + "\n";
  }
  if (calibration.array_offset) {
    text += in_flags(calibration.array_offset->words) +
            fmt::format(" ({:.0f} nats)\n", calibration.array_offset->nats);
  }
  return text;
}

std::string draw_table(const LearnedSensor& sensor) {
  const LearnedTable& table = *sensor.table;
  const bool levels = table.layer.of == MapLayer::mean_level;
  Chart chart{
      .title = levels ? "what an element reads, by the map's mean pressure where it lies"
                      : "what an element reads, by the map's log odds where it lies",
      .x = {.label = levels ? fmt::format("mean pressure of the map, {}", sensor.pressure_unit)
                            : "log odds of the map, nats",
            .lower = ReadingLayer::first_node,
            .upper = ReadingLayer::largest_value + 0.5,
            .ticks = ticks_of(table.layer)},
      .y = {.label = "probability of the reading", .lower = 0.0, .upper = 1.02},
      .rule = -9.0,
      .left_of_rule = "untouched: mm to occupied | free"};
  for (const bool sensed : {true, false}) {
    std::vector<int> nodes = nodes_of(sensed);
    std::erase_if(nodes, [&](int node) { return !is_learned(table.shared, node); });
    if (!sensed && nodes.empty()) {
      chart.x.lower = -ReadingLayer::largest_value - 0.5;
      std::erase_if(chart.x.ticks, [&](const Tick& tick) { return tick.value < chart.x.lower; });
      chart.rule.reset();
    }
    for (std::size_t level = 0; level < table.levels(); ++level) {
      chart.series.push_back({.name = sensed ? level_name(level, table, sensor.pressure_unit) : "",
                              .colour = palpate::series(level),
                              .mark = sensed ? Mark::none : Mark::circle,
                              .line = sensed ? Line::solid : Line::none,
                              .points = points_of(table.shared, level, nodes)});
    }
  }
  const ContactModel eq7{
      .classifier = sensor.classifier, .gamma = sensor.gamma, .prior = sensor.prior};
  chart.series.insert(
      chart.series.begin() + static_cast<std::ptrdiff_t>(table.levels()),
      {.name = "No Contact by Eq. 7",
       .colour = comparison_grey,
       .mark = Mark::none,
       .line = Line::dotted,
       .points = points_of(initial_table(table.layer, table.levels(), eq7), 0, nodes_of(true))});
  return draw_chart(chart);
}

ReliabilityFigure reliability_of(const SensorCalibration& calibration) {
  return {
      .curves = {curve_of("Eq. 7", *calibration.before), curve_of("learned", *calibration.after)}};
}

}  // namespace palpate::cli
