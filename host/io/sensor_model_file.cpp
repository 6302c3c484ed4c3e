#include <array>
#include <fstream>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "palpate/learned_sensor.hpp"
#include "yaml/yaml_entry.hpp"

namespace palpate {

namespace {

using Entry = YamlEntry;
constexpr const char* file_format = "palpate.sensor_model";

// The keys of each part of a sensor model, in the order in which they are written. `keys` reads
// them or writes them: keys(key, value), or keys(key, value, stored) for a value that may be left
// out.

template <typename Keys>
void describe(Keys& keys, DisplacementSd& sd) {
  keys("mm", sd.mm);
  keys("rad", sd.rad);
}

template <typename Keys>
void describe(Keys& keys, BinSteps& steps) {
  keys("x_mm", steps.x_mm);
  keys("y_mm", steps.y_mm);
  keys("theta_rad", steps.theta_rad);
}

template <typename Keys>
void describe(Keys& keys, SingleFitScale& scale) {
  keys("mean", scale.mean);
  keys("sd", scale.sd);
}

template <typename Keys>
void describe(Keys& keys, FitArray& array) {
  keys("elements", array.elements);
  keys("spacing_mm", array.spacing_mm);
}

template <typename Keys>
void describe(Keys& keys, FitScale& scale) {
  keys("mean", scale.mean);
  keys("sd", scale.sd);
  keys("shared_sd", scale.shared_sd, scale.shared_sd > 0.0);
  keys("alone", scale.single_touch);
  keys("stranger_sd", scale.stranger_sd);
  keys("stranger_alone", scale.stranger_single_touch);
  keys("array", scale.array);
}

template <typename Keys>
void describe(Keys& keys, PoseScale& scale) {
  keys("factor", scale.factor);
  keys("map_sd_mm", scale.map_sd_mm);
}

template <typename Keys>
void describe(Keys& keys, FeatureDistribution& distribution) {
  keys("mean", distribution.mean);
  keys("sd", distribution.sd);
  keys("correlation", distribution.correlation);
}

template <typename Keys>
void describe(Keys& keys, LearnedFeatures& features) {
  keys("weight", features.weight);
  keys("any", features.any);
  keys("objects", features.objects, !features.objects.empty());
}

template <typename Keys>
void describe(Keys& keys, LearnedTable& table) {
  keys("layer", table.layer.of);
  keys("near_mm", table.layer.near_mm);
  keys("far_mm", table.layer.far_mm);
  keys("unit_level", table.layer.unit_level);
  keys("full_level", table.layer.full_level);
  keys.list("level_edges", table.level_edges);
  keys("all", table.shared);
  keys("objects", table.objects, !table.objects.empty());
}

template <typename Keys>
void describe(Keys& keys, LearnedSensor& sensor) {
  keys("maps", sensor.maps, !sensor.maps.empty());
  keys("pressure_unit", sensor.pressure_unit);
  keys("noise", sensor.noise);
  keys("threshold", sensor.classifier.threshold);
  keys("ratio", sensor.classifier.ratio);
  keys("gamma", sensor.gamma);
  keys("prior", sensor.prior);
  keys("spread_mm", sensor.spread_mm);
  keys("touch_sd", sensor.touch_sd, !sensor.touch_sd.none());
  keys("temperature", sensor.temperature);
  keys("temperature_growth", sensor.temperature_growth, sensor.temperature_growth > 0.0);
  keys("bins", sensor.bins);
  keys("fit_scale", sensor.fit_scale);
  keys("pose_scale", sensor.pose_scale);
  keys("features", sensor.features);
  keys("table", sensor.table);
}

/// Reads keys, which come in any order, into the values that they belong to.
class KeyReader {
 public:
  template <typename Value>
  void operator()(const char* key, Value& value, bool /*stored*/ = true) {
    keys.emplace_back(key, [&value](const Entry& entry) { read(entry, value); });
  }
  void list(const char* key, std::vector<double>& numbers) {
    keys.emplace_back(key, [&numbers](const Entry& entry) { numbers = list_in(entry); });
  }

  YamlKeys keys;

 private:
  static std::vector<double> list_in(const Entry& entry) {
    std::vector<double> numbers;
    for (const Entry& number : entry.list("give a list of numbers")) {
      numbers.push_back(number.number());
    }
    return numbers;
  }

  static void read(const Entry& entry, double& number) { number = entry.number(); }
  static void read(const Entry& entry, std::string& text) { text = entry.text(); }
  static void read(const Entry& entry, MapLayer& layer) {
    layer = entry.one_of<MapLayer>(
        {{"log_odds", MapLayer::log_odds}, {"mean_level", MapLayer::mean_level}});
  }
  template <std::size_t count>
  static void read(const Entry& entry, std::array<double, count>& numbers) {
    const std::vector<Entry> entries =
        entry.list(count, entry.key == "correlation"
                              ? "give those of area and force, area and peak, force and peak"
                              : "give the area's, the force's and the peak's number");
    for (std::size_t i = 0; i < count; ++i) {
      numbers[i] = entries[i].number();
    }
  }
  /// A list for every level, each with a number for every node.
  static void read(const Entry& entry, std::vector<double>& levels) {
    for (const Entry& level : entry.list("give a list of numbers for each level")) {
      const std::vector<double> numbers = list_in(level);
      if (numbers.size() != ReadingLayer::nodes) {
        level.refuse(fmt::format("give {} numbers, one for each node", ReadingLayer::nodes));
      }
      levels.insert(levels.end(), numbers.begin(), numbers.end());
    }
  }
  template <typename Value>
  static void read(const Entry& entry, std::optional<Value>& value) {
    read(entry, value.emplace());
  }
  template <typename Value>
  static void read(const Entry& entry, std::map<std::string, Value>& by_label) {
    if (!entry.node.IsMap()) {
      entry.refuse("give an entry for each label");
    }
    for (const auto& item : entry.node) {
      const std::string label = Entry{entry.file, entry.key, item.first}.text();
      const auto [value, is_new] = by_label.try_emplace(label);
      if (!is_new) {
        entry.refuse(fmt::format("'{}' stands here twice; leave one out", label));
      }
      read(Entry{entry.file, entry.key + ": " + label, item.second}, value->second);
    }
  }
  template <typename Part>
  static void read(const Entry& entry, Part& part) {
    KeyReader inner;
    describe(inner, part);
    read_keys(entry, inner.keys);
  }
};

class KeyWriter {
 public:
  explicit KeyWriter(YAML::Emitter& out) : out_(out) {}

  template <typename Value>
  void operator()(const char* key, Value& value, bool stored = true) {
    if (stored) {
      out_ << YAML::Key << key << YAML::Value;
      write(value);
    }
  }
  template <typename Value>
  void operator()(const char* key, std::optional<Value>& value) {
    if (value) {
      (*this)(key, *value);
    }
  }
  void list(const char* key, const std::vector<double>& numbers) {
    out_ << YAML::Key << key << YAML::Value;
    write_list(numbers);
  }

 private:
  void write_list(std::span<const double> numbers) {
    out_ << YAML::Flow << YAML::BeginSeq;
    for (const double number : numbers) {
      out_ << fmt::format("{:.6g}", number);
    }
    out_ << YAML::EndSeq;
  }

  void write(double number) { out_ << fmt::format("{:.10g}", number); }
  void write(std::string& text) { out_ << text; }
  void write(MapLayer layer) { out_ << (layer == MapLayer::log_odds ? "log_odds" : "mean_level"); }
  template <std::size_t count>
  void write(std::array<double, count>& numbers) {
    write_list(numbers);
  }
  void write(std::vector<double>& levels) {
    out_ << YAML::BeginSeq;
    for (std::size_t first = 0; first < levels.size(); first += ReadingLayer::nodes) {
      write_list(std::span(levels).subspan(first, ReadingLayer::nodes));
    }
    out_ << YAML::EndSeq;
  }
  template <typename Value>
  void write(std::map<std::string, Value>& by_label) {
    out_ << YAML::BeginMap;
    for (auto& [label, value] : by_label) {
      out_ << YAML::Key << YAML::DoubleQuoted << label << YAML::Value;
      write(value);
    }
    out_ << YAML::EndMap;
  }
  template <typename Part>
  void write(Part& part) {
    constexpr bool long_part =
        std::is_same_v<Part, LearnedTable> || std::is_same_v<Part, LearnedFeatures>;
    out_ << (long_part ? YAML::Block : YAML::Flow) << YAML::BeginMap;
    describe(*this, part);
    out_ << YAML::EndMap;
  }

  YAML::Emitter& out_;
};

}  // namespace

LearnedSensor read_sensor_model(const std::filesystem::path& path) {
  require_readable(path);
  constexpr std::string_view hdf5 = "\x89HDF";
  std::string start(hdf5.size(), '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), std::ssize(start));
  if (start == hdf5) {
    refuse(path,
           "is a recording or another HDF5 file, and no sensor model; give the YAML file that "
           "palpate calibrate or palpate map wrote");
  }
  LearnedSensor sensor;
  bool has_format = false;
  read_document(std::ifstream(path), path, "the sensor model", [&](const Entry& root) {
    KeyReader reader;
    reader.keys = {
        {"format",
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
        {"psf_mm",
         [](const Entry& e) { e.refuse("is no key any more; remove it, spread_mm alone counts"); }},
        {"familiarity", [](const Entry& e) {
           e.refuse(
               "is no key any more; remove it, or learn the sensor again: its fit_scale then "
               "tells by stranger_alone what one touch of a stranger is like");
         }}};
    describe(reader, sensor);
    read_keys(root, reader.keys);
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
  out << YAML::Key << "format" << YAML::Value << file_format;
  out << YAML::Key << "version" << YAML::Value << 1;
  KeyWriter writer(out);
  LearnedSensor written = sensor;  // readers and writers are given values that may change
  describe(writer, written);
  out << YAML::EndMap;
  AtomicFile file(path);
  file.write(std::string(out.c_str()) + "\n");
  file.commit();
}

}  // namespace palpate
