#include <gtest/gtest.h>

#include <numeric>

#include <fmt/ranges.h>

#include "file_parts.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate::sensor_model_file_test {

// Every key, as far as the numbers of the table.
const std::string full_text =
    R"(format: palpate.sensor_model
version: 1
pressure_unit: raw
noise: 0.25
threshold: 15
ratio: 0.15
gamma: 0.2
prior: 0.1
spread_mm: 1.14
touch_sd: {mm: 0.5, rad: 0.0625}
temperature: 31.5
temperature_growth: 2.25
bins: {x_mm: 0.5, y_mm: 0.25, theta_rad: 0.125}
fit_scale: {mean: -4.5, sd: 12.25, shared_sd: 0.5, alone: {mean: 1.5, sd: 0.75}, )"
    R"(stranger_sd: 3.25, stranger_alone: {mean: -4.25, sd: 2.75}, )"
    R"(array: {elements: 36, spacing_mm: 1.875}}
pose_scale: {factor: 1.25, map_sd_mm: 0.375}
features:
  weight: 0.25
  any: {mean: [1, 2, 3], sd: [0.5, 0.25, 2], correlation: [0, 0, 0]}
  objects:
    "pen": {mean: [4, 5, 6], sd: [1, 1, 0.75], correlation: [0.5, -0.25, 0.125]}
table:
  layer: mean_level
  near_mm: 3.5
  far_mm: 11
  unit_level: 2
  full_level: 250
  level_edges: [35]
  all:
)";

// The table's numbers are logs of probabilities: these count up, to below 0.
constexpr int first_number = -150;

// A line for each of the table's three levels, with a number for every node.
std::string levels_of(const std::string& indent) {
  std::string lines;
  std::vector<int> numbers(ReadingLayer::nodes);
  for (const int level : {0, 1, 2}) {
    std::iota(numbers.begin(), numbers.end(), first_number + level * ReadingLayer::nodes);
    lines += fmt::format("{}- [{}]\n", indent, fmt::join(numbers, ", "));
  }
  return lines;
}

std::string full_file() {
  return full_text + levels_of("    ") + "  objects:\n    \"pen: \\\"blue\\\"\":\n" +
         levels_of("      ");
}

class SensorModelFile : public OneFile {
 protected:
  SensorModelFile() : OneFile("sensor.yaml") {}

  std::string written(const LearnedSensor& sensor) const {
    write_sensor_model(path_, sensor);
    return bytes_of(path_);
  }
  LearnedSensor read(const std::string& text) const {
    put_bytes(path_, text);
    return read_sensor_model(path_);
  }
  std::string message(const std::string& text) const {
    return refusal([&] { read(text); });
  }
};

TEST_F(SensorModelFile, IsWrittenAndReadInEveryKey) {
  const LearnedSensor s = read(full_file());
  EXPECT_EQ(written(s), full_file());
  EXPECT_EQ(s.pressure_unit, "raw");
  const std::vector<double> numbers{
      s.noise,      s.classifier.threshold, s.classifier.ratio, s.gamma,       s.prior,
      s.spread_mm,  s.touch_sd.mm,          s.touch_sd.rad,     s.temperature, s.bins->x_mm,
      s.bins->y_mm, s.bins->theta_rad};
  EXPECT_EQ(numbers, (std::vector<double>{0.25, 15, 0.15, 0.2, 0.1, 1.14, 0.5, 0.0625, 31.5, 0.5,
                                          0.25, 0.125}));
  const FitScale& fit = s.fit_scale.value();
  const std::vector<double> of_fit{fit.mean, fit.sd, fit.single_touch->mean,
                                   fit.stranger_single_touch->sd, fit.array->spacing_mm};
  EXPECT_EQ(of_fit, (std::vector<double>{-4.5, 12.25, 1.5, 2.75, 1.875}));
  EXPECT_EQ(s.features->objects.at("pen").correlation[1], -0.25);
  std::vector<double> levels(3 * ReadingLayer::nodes);
  std::iota(levels.begin(), levels.end(), first_number);
  EXPECT_EQ(s.table->layer.far_mm, 11.0);
  EXPECT_EQ(s.table->shared, levels);
  EXPECT_EQ(s.table->objects.at("pen: \"blue\""), levels);
}

TEST_F(SensorModelFile, MayLeaveKeysOut) {
  const LearnedSensor bare = read("format: palpate.sensor_model\nthreshold: 3\n");
  EXPECT_EQ(bare.classifier.threshold, 3.0);
  EXPECT_EQ(bare.temperature, 1.0);
  EXPECT_EQ(bare.temperature_growth, 0.0);
  EXPECT_FALSE(bare.table || bare.features || bare.fit_scale || bare.bins || bare.pose_scale);
  LearnedSensor sensor = bare;  // which tells nothing of strangers and of single touches
  sensor.fit_scale = FitScale{.mean = 0.5, .sd = 12.25};
  EXPECT_NE(written(sensor).find("\nfit_scale: {mean: 0.5, sd: 12.25}\n"), std::string::npos);
  const FitScale scale = read_sensor_model(path_).fit_scale.value();
  EXPECT_EQ(scale.sd, 12.25);
  EXPECT_FALSE(scale.stranger_sd || scale.stranger_single_touch || scale.single_touch ||
               scale.array);
}

TEST_F(SensorModelFile, NamesTheKeyThatIsWrong) {
  const std::string text = full_file();
  struct Row {
    std::string right;
    const char* wrong;
    const char* key;
    const char* value = "";
  };
  for (const auto& [right, wrong, key, value] :
       {Row{"[0.5, -0.25, 0.125]", "[0.9, 0.9, -0.9]", "features: correlation", "0.9, 0.9, -0.9"},
        {"[0.5, -0.25, 0.125]", "[0.5, 2]", "correlation"},
        {"format: palpate.sensor_model", "version: 1", "version", "twice"},
        {"palpate.sensor_model", "palpate.map", "format"},
        {"version: 1", "version: 2", "version", "reads version 1"},
        {"threshold: 15", "treshold: 15", "treshold"},
        {"threshold: 15", "threshold: -1", "threshold", "-1"},
        {"temperature: 31.5", "temperature: 0", "temperature"},
        {"temperature_growth: 2.25", "temperature_growth: -1", "temperature_growth"},
        {"x_mm: 0.5", "x_mm: -0.5", "bins", "-0.5"},
        {"mean_level", "pressure", "layer", "log_odds, mean_level"},
        {"[35]", "[60.5, 35]", "level_edges"},
        {"[35]", "[]", "log_likelihood"},
        {"[1, 2, 3]", "[1, 2]", "line 18", "mean"},
        {"sd: 12.25", "sd: 0", "fit_scale: sd"},
        {"elements: 36", "elements: 0", "fit_scale: array"},
        {"shared_sd: 0.5", "shared_sd: -1", "fit_scale: shared_sd"},
        {"mean: 1.5, sd: 0.75", "mean: 1.5, sd: 0", "fit_scale: alone: sd"},
        {"stranger_sd: 3.25", "stranger_sd: 0", "fit_scale: stranger_sd"},
        {"mean: -4.25, sd: 2.75", "mean: -4.25, sd: 0.5", "fit_scale: stranger_alone: sd"},
        {"noise: 0.25", "psf_mm: 1", "psf_mm", "remove it"},
        {"noise: 0.25", "familiarity: {offset: 1}", "familiarity", "remove it"},
        {"raw", "psi", "pressure_unit", "kPa or raw"}}) {
    SCOPED_TRACE(wrong);
    const std::size_t at = text.find(right);
    ASSERT_NE(at, std::string::npos);
    expect_named(message(std::string(text).replace(at, right.size(), wrong)), {key, value});
  }
  expect_named(message("threshold: 3\n"), {"format"});
  expect_named(message("format: palpate.sensor_model\n---\nthreshold: 3\n"), {"line 2"});
  expect_named(message("a: [\n"), {"line", "YAML"});
}

}  // namespace palpate::sensor_model_file_test
