#include <cmath>
#include <fstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "palpate/learned_sensor.hpp"
#include "yaml/yaml_entry.hpp"

namespace palpate {

namespace {

using Entry = YamlEntry;
constexpr const char* file_format = "palpate.sensor_model";

/// Reads a list of numbers.
std::vector<double> read_numbers(const Entry& entry) {
  std::vector<double> numbers;
  for (const Entry& number : entry.list("give a list of numbers")) {
    numbers.push_back(number.number());
  }
  return numbers;
}

template <std::size_t count>
std::array<double, count> read_array(const Entry& entry, const char* remedy) {
  std::array<double, count> numbers{};
  const std::vector<Entry> entries = entry.list(count, remedy);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    numbers[i] = entries[i].number();
  }
  return numbers;
}

/// Reads a list for every level, each with a number for every node.
std::vector<double> read_levels(const Entry& entry) {
  std::vector<double> all;
  for (const Entry& level : entry.list("give a list of numbers for each level")) {
    const std::vector<double> numbers = read_numbers(level);
    if (numbers.size() != ReadingLayer::nodes) {
      level.refuse(fmt::format("give {} numbers, one for each node", ReadingLayer::nodes));
    }
    all.insert(all.end(), numbers.begin(), numbers.end());
  }
  return all;
}

/// Reads what every label of a map has.
template <typename Value, typename Read>
std::map<std::string, Value> read_by_label(const Entry& entry, const Read& read) {
  if (!entry.node.IsMap()) {
    entry.refuse("give an entry for each label");
  }
  std::map<std::string, Value> values;
  for (const auto& item : entry.node) {
    const std::string label = Entry{entry.file, entry.key, item.first}.text();
    if (!values.emplace(label, read(Entry{entry.file, entry.key + ": " + label, item.second}))
             .second) {
      entry.refuse(fmt::format("'{}' stands here twice; leave one out", label));
    }
  }
  return values;
}

LearnedTable read_table(const Entry& entry) {
  LearnedTable table;
  ReadingLayer& layer = table.layer;
  read_keys(entry, {{"layer",
                     [&](const Entry& e) {
                       layer.of = e.one_of<MapLayer>({{"log_odds", MapLayer::log_odds},
                                                      {"mean_level", MapLayer::mean_level}});
                     }},
                    {"near_mm", [&](const Entry& e) { layer.near_mm = e.number(); }},
                    {"far_mm", [&](const Entry& e) { layer.far_mm = e.number(); }},
                    {"unit_level", [&](const Entry& e) { layer.unit_level = e.number(); }},
                    {"full_level", [&](const Entry& e) { layer.full_level = e.number(); }},
                    {"level_edges", [&](const Entry& e) { table.level_edges = read_numbers(e); }},
                    {"all", [&](const Entry& e) { table.shared = read_levels(e); }},
                    {"objects", [&](const Entry& e) {
                       table.objects = read_by_label<std::vector<double>>(e, read_levels);
                     }}});
  return table;
}

FeatureDistribution read_distribution(const Entry& entry) {
  constexpr const char* of_each = "give the area's, the force's and the peak's number";
  FeatureDistribution distribution;
  read_keys(
      entry,
      {{"mean",
        [&](const Entry& e) { distribution.mean = read_array<PressFeatures::count>(e, of_each); }},
       {"sd",
        [&](const Entry& e) { distribution.sd = read_array<PressFeatures::count>(e, of_each); }},
       {"correlation", [&](const Entry& e) {
          distribution.correlation = read_array<FeatureDistribution::pairs>(
              e, "give those of area and force, area and peak, force and peak");
        }}});
  return distribution;
}

LearnedFeatures read_learned_features(const Entry& entry) {
  LearnedFeatures features;
  read_keys(entry, {{"weight", [&](const Entry& e) { features.weight = e.number(); }},
                    {"any", [&](const Entry& e) { features.any = read_distribution(e); }},
                    {"objects", [&](const Entry& e) {
                       features.objects = read_by_label<FeatureDistribution>(e, read_distribution);
                     }}});
  return features;
}

Familiarity read_familiarity(const Entry& entry) {
  Familiarity familiarity;
  read_keys(entry,
            {{"offset", [&](const Entry& e) { familiarity.offset = e.number(); }},
             {"explained_slope", [&](const Entry& e) { familiarity.explained_slope = e.number(); }},
             {"lead_slope", [&](const Entry& e) { familiarity.lead_slope = e.number(); }}});
  return familiarity;
}

FitScale read_fit_scale(const Entry& entry) {
  FitScale scale;
  read_keys(entry, {{"mean", [&](const Entry& e) { scale.mean = e.number(); }},
                    {"sd", [&](const Entry& e) { scale.sd = e.number(); }}});
  return scale;
}

DisplacementSd read_sd(const Entry& entry) {
  DisplacementSd sd;
  read_keys(entry, {{"mm", [&](const Entry& e) { sd.mm = e.number(); }},
                    {"rad", [&](const Entry& e) { sd.rad = e.number(); }}});
  return sd;
}

BinSteps read_steps(const Entry& entry) {
  BinSteps steps;
  read_keys(entry, {{"x_mm", [&](const Entry& e) { steps.x_mm = e.number(); }},
                    {"y_mm", [&](const Entry& e) { steps.y_mm = e.number(); }},
                    {"theta_rad", [&](const Entry& e) { steps.theta_rad = e.number(); }}});
  return steps;
}

void emit(YAML::Emitter& out, const std::vector<double>& numbers) {
  out << YAML::Flow << YAML::BeginSeq;
  for (const double number : numbers) {
    out << fmt::format("{:.6g}", number);
  }
  out << YAML::EndSeq;
}

void emit_levels(YAML::Emitter& out, const std::vector<double>& numbers) {
  out << YAML::BeginSeq;
  for (std::size_t first = 0; first < numbers.size(); first += ReadingLayer::nodes) {
    const auto from = numbers.begin() + static_cast<std::ptrdiff_t>(first);
    emit(out, {from, from + ReadingLayer::nodes});
  }
  out << YAML::EndSeq;
}

void emit(YAML::Emitter& out, const FeatureDistribution& distribution) {
  out << YAML::Flow << YAML::BeginMap << YAML::Key << "mean" << YAML::Value;
  emit(out, {distribution.mean.begin(), distribution.mean.end()});
  out << YAML::Key << "sd" << YAML::Value;
  emit(out, {distribution.sd.begin(), distribution.sd.end()});
  out << YAML::Key << "correlation" << YAML::Value;
  emit(out, {distribution.correlation.begin(), distribution.correlation.end()});
  out << YAML::EndMap;
}

void emit_table(YAML::Emitter& out, const LearnedTable& table) {
  const auto key = [&](const char* name) -> YAML::Emitter& {
    return out << YAML::Key << name << YAML::Value;
  };
  const auto number = [&](const char* name, double value) {
    key(name) << fmt::format("{:.10g}", value);
  };
  key("table") << YAML::BeginMap;
  key("layer") << (table.layer.of == MapLayer::log_odds ? "log_odds" : "mean_level");
  number("near_mm", table.layer.near_mm);
  number("far_mm", table.layer.far_mm);
  number("unit_level", table.layer.unit_level);
  number("full_level", table.layer.full_level);
  key("level_edges");
  emit(out, table.level_edges);
  key("all");
  emit_levels(out, table.shared);
  if (!table.objects.empty()) {
    key("objects") << YAML::BeginMap;
    for (const auto& [label, numbers] : table.objects) {
      out << YAML::Key << YAML::DoubleQuoted << label << YAML::Value;
      emit_levels(out, numbers);
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
}

void emit_features(YAML::Emitter& out, const LearnedFeatures& features) {
  out << YAML::Key << "features" << YAML::Value << YAML::BeginMap << YAML::Key << "weight"
      << YAML::Value << fmt::format("{:.10g}", features.weight) << YAML::Key << "any"
      << YAML::Value;
  emit(out, features.any);
  if (!features.objects.empty()) {
    out << YAML::Key << "objects" << YAML::Value << YAML::BeginMap;
    for (const auto& [label, own] : features.objects) {
      out << YAML::Key << YAML::DoubleQuoted << label << YAML::Value;
      emit(out, own);
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
}

}  // namespace

LearnedSensor read_sensor_model(const std::filesystem::path& path) {
  require_readable(path);
  LearnedSensor sensor;
  bool has_format = false;
  read_document(std::ifstream(path), path, "the sensor model", [&](const Entry& root) {
    const auto number = [](double& value) {
      return [&value](const Entry& e) { value = e.number(); };
    };
    read_keys(root,
              {{"format",
                [&](const Entry& e) {
                  has_format = e.text() == file_format;
                  if (!has_format) {
                    e.refuse(fmt::format("give {}, as palpate calibrate writes it", file_format));
                  }
                }},
               {"version",
                [&](const Entry& e) {
                  if (e.integer(1) > 1) {
                    e.refuse("this palpate reads version 1; update palpate");
                  }
                }},
               {"pressure_unit", [&](const Entry& e) { sensor.pressure_unit = e.text(); }},
               {"noise", number(sensor.noise)},
               {"threshold", number(sensor.classifier.threshold)},
               {"ratio", number(sensor.classifier.ratio)},
               {"gamma", number(sensor.gamma)},
               {"prior", number(sensor.prior)},
               {"psf_mm", [&](const Entry& e) { sensor.psf_mm = e.number(); }},
               {"spread_mm", number(sensor.spread_mm)},
               {"touch_sd", [&](const Entry& e) { sensor.touch_sd = read_sd(e); }},
               {"temperature", number(sensor.temperature)},
               {"temperature_growth", number(sensor.temperature_growth)},
               {"bins", [&](const Entry& e) { sensor.bins = read_steps(e); }},
               {"table", [&](const Entry& e) { sensor.table = read_table(e); }},
               {"features", [&](const Entry& e) { sensor.features = read_learned_features(e); }},
               {"familiarity", [&](const Entry& e) { sensor.familiarity = read_familiarity(e); }},
               {"fit_scale", [&](const Entry& e) { sensor.fit_scale = read_fit_scale(e); }}});
  });
  if (!has_format) {
    refuse(path, "key 'format' is missing: not a sensor model; make one with palpate calibrate");
  }
  try {
    sensor.validate();
  } catch (const Error& error) {
    refuse(path, "{}", error.what());
  }
  return sensor;
}

void write_sensor_model(const std::filesystem::path& path, const LearnedSensor& sensor) {
  sensor.validate();
  YAML::Emitter out;
  const auto key = [&](const char* name) -> YAML::Emitter& {
    return out << YAML::Key << name << YAML::Value;
  };
  const auto number = [&](const char* name, double value) {
    key(name) << fmt::format("{:.10g}", value);
  };
  out << YAML::BeginMap;
  key("format") << file_format;
  key("version") << 1;
  key("pressure_unit") << sensor.pressure_unit;
  number("noise", sensor.noise);
  number("threshold", sensor.classifier.threshold);
  number("ratio", sensor.classifier.ratio);
  number("gamma", sensor.gamma);
  number("prior", sensor.prior);
  if (sensor.psf_mm) {
    number("psf_mm", *sensor.psf_mm);
  }
  number("spread_mm", sensor.spread_mm);
  if (!sensor.touch_sd.none()) {
    key("touch_sd") << YAML::Flow << YAML::BeginMap;
    number("mm", sensor.touch_sd.mm);
    number("rad", sensor.touch_sd.rad);
    out << YAML::EndMap;
  }
  number("temperature", sensor.temperature);
  if (sensor.temperature_growth > 0.0) {
    number("temperature_growth", sensor.temperature_growth);
  }
  if (sensor.bins) {
    key("bins") << YAML::Flow << YAML::BeginMap;
    number("x_mm", sensor.bins->x_mm);
    number("y_mm", sensor.bins->y_mm);
    number("theta_rad", sensor.bins->theta_rad);
    out << YAML::EndMap;
  }
  if (sensor.familiarity) {
    key("familiarity") << YAML::Flow << YAML::BeginMap;
    number("offset", sensor.familiarity->offset);
    number("explained_slope", sensor.familiarity->explained_slope);
    number("lead_slope", sensor.familiarity->lead_slope);
    out << YAML::EndMap;
  }
  if (sensor.fit_scale) {
    key("fit_scale") << YAML::Flow << YAML::BeginMap;
    number("mean", sensor.fit_scale->mean);
    number("sd", sensor.fit_scale->sd);
    out << YAML::EndMap;
  }
  if (sensor.features) {
    emit_features(out, *sensor.features);
  }
  if (sensor.table) {
    emit_table(out, *sensor.table);
  }
  out << YAML::EndMap;
  AtomicFile file(path);
  file.write(std::string(out.c_str()) + "\n");
  file.commit();
}

}  // namespace palpate
