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

/// Reads a section of numbers alone.
void read_section(const Entry& entry, const std::vector<std::pair<const char*, double*>>& numbers) {
  YamlKeys keys;
  for (const auto& [key, value] : numbers) {
    keys.emplace_back(key, [number = value](const Entry& e) { *number = e.number(); });
  }
  read_keys(entry, keys);
}

YAML::Emitter& emit_key(YAML::Emitter& out, const char* key) {
  return out << YAML::Key << key << YAML::Value;
}

void emit(YAML::Emitter& out, const char* key, double number) {
  emit_key(out, key) << fmt::format("{:.10g}", number);
}

void emit_section(YAML::Emitter& out, const char* key,
                  const std::vector<std::pair<const char*, double>>& numbers) {
  emit_key(out, key) << YAML::Flow << YAML::BeginMap;
  for (const auto& [name, number] : numbers) {
    emit(out, name, number);
  }
  out << YAML::EndMap;
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
  out << YAML::Flow << YAML::BeginMap;
  emit_key(out, "mean");
  emit(out, {distribution.mean.begin(), distribution.mean.end()});
  emit_key(out, "sd");
  emit(out, {distribution.sd.begin(), distribution.sd.end()});
  emit_key(out, "correlation");
  emit(out, {distribution.correlation.begin(), distribution.correlation.end()});
  out << YAML::EndMap;
}

/// Emits what every label of a map has; nothing without a label.
template <typename Value, typename Emit>
void emit_by_label(YAML::Emitter& out, const std::map<std::string, Value>& values,
                   const Emit& emit_value) {
  if (values.empty()) {
    return;
  }
  emit_key(out, "objects") << YAML::BeginMap;
  for (const auto& [label, value] : values) {
    out << YAML::Key << YAML::DoubleQuoted << label << YAML::Value;
    emit_value(value);
  }
  out << YAML::EndMap;
}

void emit_table(YAML::Emitter& out, const LearnedTable& table) {
  emit_key(out, "table") << YAML::BeginMap;
  emit_key(out, "layer") << (table.layer.of == MapLayer::log_odds ? "log_odds" : "mean_level");
  emit(out, "near_mm", table.layer.near_mm);
  emit(out, "far_mm", table.layer.far_mm);
  emit(out, "unit_level", table.layer.unit_level);
  emit(out, "full_level", table.layer.full_level);
  emit_key(out, "level_edges");
  emit(out, table.level_edges);
  emit_key(out, "all");
  emit_levels(out, table.shared);
  emit_by_label(out, table.objects, [&](const auto& numbers) { emit_levels(out, numbers); });
  out << YAML::EndMap;
}

void emit_features(YAML::Emitter& out, const LearnedFeatures& features) {
  emit_key(out, "features") << YAML::BeginMap;
  emit(out, "weight", features.weight);
  emit_key(out, "any");
  emit(out, features.any);
  emit_by_label(out, features.objects, [&](const auto& own) { emit(out, own); });
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
    read_keys(
        root,
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
         {"touch_sd",
          [&](const Entry& e) {
            read_section(e, {{"mm", &sensor.touch_sd.mm}, {"rad", &sensor.touch_sd.rad}});
          }},
         {"temperature", number(sensor.temperature)},
         {"temperature_growth", number(sensor.temperature_growth)},
         {"bins",
          [&](const Entry& e) {
            BinSteps& steps = sensor.bins.emplace();
            read_section(
                e, {{"x_mm", &steps.x_mm}, {"y_mm", &steps.y_mm}, {"theta_rad", &steps.theta_rad}});
          }},
         {"table", [&](const Entry& e) { sensor.table = read_table(e); }},
         {"features", [&](const Entry& e) { sensor.features = read_learned_features(e); }},
         {"familiarity",
          [&](const Entry& e) {
            Familiarity& familiarity = sensor.familiarity.emplace();
            read_section(e, {{"offset", &familiarity.offset},
                             {"explained_slope", &familiarity.explained_slope},
                             {"lead_slope", &familiarity.lead_slope}});
          }},
         {"fit_scale", [&](const Entry& e) {
            FitScale& scale = sensor.fit_scale.emplace();
            read_section(
                e, {{"mean", &scale.mean}, {"sd", &scale.sd}, {"shared_sd", &scale.shared_sd}});
          }}});
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
  out << YAML::BeginMap;
  emit_key(out, "format") << file_format;
  emit_key(out, "version") << 1;
  emit_key(out, "pressure_unit") << sensor.pressure_unit;
  emit(out, "noise", sensor.noise);
  emit(out, "threshold", sensor.classifier.threshold);
  emit(out, "ratio", sensor.classifier.ratio);
  emit(out, "gamma", sensor.gamma);
  emit(out, "prior", sensor.prior);
  if (sensor.psf_mm) {
    emit(out, "psf_mm", *sensor.psf_mm);
  }
  emit(out, "spread_mm", sensor.spread_mm);
  if (!sensor.touch_sd.none()) {
    emit_section(out, "touch_sd", {{"mm", sensor.touch_sd.mm}, {"rad", sensor.touch_sd.rad}});
  }
  emit(out, "temperature", sensor.temperature);
  if (sensor.temperature_growth > 0.0) {
    emit(out, "temperature_growth", sensor.temperature_growth);
  }
  if (const auto& steps = sensor.bins) {
    emit_section(out, "bins",
                 {{"x_mm", steps->x_mm}, {"y_mm", steps->y_mm}, {"theta_rad", steps->theta_rad}});
  }
  if (const auto& familiarity = sensor.familiarity) {
    emit_section(out, "familiarity",
                 {{"offset", familiarity->offset},
                  {"explained_slope", familiarity->explained_slope},
                  {"lead_slope", familiarity->lead_slope}});
  }
  if (const auto& scale = sensor.fit_scale) {
    emit_section(out, "fit_scale",
                 {{"mean", scale->mean}, {"sd", scale->sd}, {"shared_sd", scale->shared_sd}});
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
