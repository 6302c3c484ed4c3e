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
#include "learning/table_learning.hpp"
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
  add("spread of maps, mm", short_number(initial.spread_mm), sensor.spread_mm);
  add("gamma of Eq. 7", short_number(initial.gamma), sensor.gamma);
  add("prior", "", sensor.prior);
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
    if (const auto& learned = sensor.fit_scale->stranger_alone) {
      table.add({"of one touch of strangers, on it", "0 +- 1",
                 fmt::format("{:.2g} +- {:.2g}", learned->mean, learned->sd)});
    }
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

}  // namespace

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
  if (const std::string words = unlearned_strangers(calibration.sensor); !words.empty()) {
    text += words + "\n";
  }
  if (calibration.array_offset) {
    text += in_flags(calibration.array_offset->words) +
            fmt::format(" ({:.0f} nats)\n", calibration.array_offset->nats);
  }
  return text;
}

}  // namespace palpate::cli
