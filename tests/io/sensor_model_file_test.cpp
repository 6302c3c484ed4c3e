#include <gtest/gtest.h>

#include "palpate/learned_sensor.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::sensor_model_file_test {

LearnedSensor full_sensor() {
  LearnedSensor sensor{
      .pressure_unit = "raw",
      .noise = 0.25,
      .classifier = {.threshold = 15.0, .ratio = 0.15},
      .gamma = 0.2,
      .prior = 0.1,
      .spread_mm = 1.14,
      .touch_sd = {.mm = 0.5, .rad = 0.0625},
      .table = LearnedTable{},
      .temperature = 31.5,
      .temperature_growth = 2.25,
      .bins = BinSteps{.x_mm = 0.5, .y_mm = 0.25, .theta_rad = 0.125},
      .features = LearnedFeatures{},
      .fit_scale = FitScale{.mean = -4.5,
                            .sd = 12.25,
                            .shared_sd = 0.5,
                            .alone = SingleFitScale{1.5, 0.75},
                            .stranger_sd = 3.25,
                            .stranger_alone = SingleFitScale{-4.25, 2.75},
                            .array = FitArray{.elements = 36.0, .spacing_mm = 1.875}}};
  LearnedTable& table = *sensor.table;
  table.layer = {.of = MapLayer::mean_level,
                 .near_mm = 3.5,
                 .far_mm = 11.0,
                 .unit_level = 2.0,
                 .full_level = 250.0};
  table.level_edges = {35.0, 60.5};
  for (std::size_t i = 0; i < table.levels() * ReadingLayer::nodes; ++i) {
    table.shared.push_back(-0.125 * static_cast<double>(i % 37));
  }
  table.objects["pen: \"blue\""] = std::vector<double>(table.shared.size(), -1.5);
  sensor.features->weight = 0.25;
  sensor.features->any = {.mean = {1.0, 2.0, 3.0}, .sd = {0.5, 0.25, 2.0}};
  sensor.features->objects["pen"] = {
      .mean = {4.0, 5.0, 6.0}, .sd = {1.0, 1.0, 0.75}, .correlation = {0.5, -0.25, 0.125}};
  return sensor;
}

class SensorModelFile : public testing::Test {
 protected:
  /// The message about a file whose text has `wrong` in the place of `right`.
  std::string message(const std::string& right, const std::string& wrong) {
    write_sensor_model(path_, full_sensor());
    std::string text = bytes_of(path_);
    const std::size_t at = text.find(right);
    EXPECT_NE(at, std::string::npos) << right << " not in\n" << text;
    text.replace(at, right.size(), wrong);
    put_bytes(path_, text);
    const std::string line = input_error([&] { read_sensor_model(path_); });
    expect_named(line, {path_.c_str()});
    return line;
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "sensor.yaml";
};

TEST_F(SensorModelFile, ComesBackAsItWasWritten) {
  const LearnedSensor written = full_sensor();
  write_sensor_model(path_, written);
  const LearnedSensor read = read_sensor_model(path_);
  EXPECT_EQ(read.pressure_unit, written.pressure_unit);
  EXPECT_EQ(read.noise, written.noise);
  EXPECT_EQ(read.classifier.threshold, written.classifier.threshold);
  EXPECT_EQ(read.classifier.ratio, written.classifier.ratio);
  EXPECT_EQ(read.gamma, written.gamma);
  EXPECT_EQ(read.prior, written.prior);
  EXPECT_EQ(read.spread_mm, written.spread_mm);
  EXPECT_EQ(read.touch_sd.mm, written.touch_sd.mm);
  EXPECT_EQ(read.touch_sd.rad, written.touch_sd.rad);
  EXPECT_EQ(read.temperature, written.temperature);
  EXPECT_EQ(read.temperature_growth, written.temperature_growth);
  ASSERT_TRUE(read.bins);
  EXPECT_EQ(read.bins->x_mm, written.bins->x_mm);
  EXPECT_EQ(read.bins->y_mm, written.bins->y_mm);
  EXPECT_EQ(read.bins->theta_rad, written.bins->theta_rad);
  ASSERT_TRUE(read.table && read.features);
  EXPECT_EQ(read.table->layer.of, written.table->layer.of);
  EXPECT_EQ(read.table->layer.near_mm, written.table->layer.near_mm);
  EXPECT_EQ(read.table->layer.far_mm, written.table->layer.far_mm);
  EXPECT_EQ(read.table->layer.unit_level, written.table->layer.unit_level);
  EXPECT_EQ(read.table->layer.full_level, written.table->layer.full_level);
  EXPECT_EQ(read.table->level_edges, written.table->level_edges);
  EXPECT_EQ(read.table->shared, written.table->shared);
  EXPECT_EQ(read.table->objects, written.table->objects);
  EXPECT_EQ(read.features->weight, written.features->weight);
  EXPECT_EQ(read.features->any.mean, written.features->any.mean);
  ASSERT_TRUE(read.features->objects.contains("pen"));
  EXPECT_EQ(read.features->objects.at("pen").sd, written.features->objects.at("pen").sd);
  EXPECT_EQ(read.features->objects.at("pen").correlation,
            written.features->objects.at("pen").correlation);
  ASSERT_TRUE(read.fit_scale);
  EXPECT_EQ(read.fit_scale->mean, written.fit_scale->mean);
  EXPECT_EQ(read.fit_scale->sd, written.fit_scale->sd);
  EXPECT_EQ(read.fit_scale->shared_sd, written.fit_scale->shared_sd);
  ASSERT_TRUE(read.fit_scale->alone);
  EXPECT_EQ(read.fit_scale->alone->mean, written.fit_scale->alone->mean);
  EXPECT_EQ(read.fit_scale->alone->sd, written.fit_scale->alone->sd);
  EXPECT_EQ(read.fit_scale->stranger_sd, written.fit_scale->stranger_sd);
  ASSERT_TRUE(read.fit_scale->stranger_alone);
  EXPECT_EQ(read.fit_scale->stranger_alone->mean, written.fit_scale->stranger_alone->mean);
  EXPECT_EQ(read.fit_scale->stranger_alone->sd, written.fit_scale->stranger_alone->sd);
  ASSERT_TRUE(read.fit_scale->array);
  EXPECT_EQ(read.fit_scale->array->elements, 36.0);
  EXPECT_EQ(read.fit_scale->array->spacing_mm, 1.875);
}

TEST_F(SensorModelFile, MayHoldLittle) {
  put_bytes(path_, "format: palpate.sensor_model\nthreshold: 3\n");
  const LearnedSensor read = read_sensor_model(path_);
  EXPECT_EQ(read.classifier.threshold, 3.0);
  EXPECT_EQ(read.temperature, 1.0);
  EXPECT_EQ(read.temperature_growth, 0.0);
  EXPECT_FALSE(read.table || read.features || read.fit_scale || read.bins);
}

TEST_F(SensorModelFile, MayTellNothingOfStrangersAndOfSingleTouches) {
  LearnedSensor sensor = full_sensor();
  sensor.fit_scale->stranger_sd.reset();
  sensor.fit_scale->stranger_alone.reset();
  sensor.fit_scale->alone.reset();
  write_sensor_model(path_, sensor);
  EXPECT_EQ(bytes_of(path_).find("stranger"), std::string::npos);
  EXPECT_EQ(bytes_of(path_).find("alone"), std::string::npos);
  const LearnedSensor read = read_sensor_model(path_);
  ASSERT_TRUE(read.fit_scale);
  EXPECT_EQ(read.fit_scale->sd, sensor.fit_scale->sd);
  EXPECT_FALSE(read.fit_scale->stranger_sd || read.fit_scale->stranger_alone ||
               read.fit_scale->alone);
}

TEST_F(SensorModelFile, SaysWhatIsWrong) {
  expect_named(message("[0.5, -0.25, 0.125]", "[0.9, 0.9, -0.9]"),
               {"features: correlation", "0.9, 0.9, -0.9"});
  expect_named(message("[0.5, -0.25, 0.125]", "[0.5, 2]"), {"correlation", "area and force"});
  expect_named(message("format: palpate.sensor_model", "version: 1"), {"twice"});
  expect_named(message("palpate.sensor_model", "palpate.map"), {"format", "palpate calibrate"});
  expect_named(message("version: 1", "version: 2"), {"version", "update"});
  expect_named(message("threshold: 15", "treshold: 15"), {"treshold"});
  expect_named(message("threshold: 15", "threshold: -1"), {"threshold", "-1"});
  expect_named(message("temperature: 31.5", "temperature: 0"), {"temperature", "positive"});
  expect_named(message("temperature_growth: 2.25", "temperature_growth: -1"),
               {"temperature_growth", "from 0"});
  expect_named(message("x_mm: 0.5", "x_mm: -0.5"), {"bins", "-0.5", "steps"});
  expect_named(message("mean_level", "pressure"), {"layer", "log_odds, mean_level"});
  expect_named(message("[35, 60.5]", "[60.5, 35]"), {"level_edges"});
  expect_named(message("[35, 60.5]", "[35]"), {"log_likelihood"});
  expect_named(message("[1, 2, 3]", "[1, 2]"), {"line 17", "mean", "area"});
  expect_named(message("sd: 12.25", "sd: 0"), {"fit_scale: sd", "positive"});
  expect_named(message("elements: 36", "elements: 0"), {"fit_scale: array", "above 0"});
  expect_named(message("shared_sd: 0.5", "shared_sd: -1"), {"fit_scale: shared_sd", "from 0"});
  expect_named(message("alone: {mean: 1.5, sd: 0.75}", "alone: {mean: 1.5, sd: 0}"),
               {"fit_scale: alone: sd", "positive"});
  expect_named(message("stranger_sd: 3.25", "stranger_sd: 0"),
               {"fit_scale: stranger_sd", "positive"});
  expect_named(
      message("stranger_alone: {mean: -4.25, sd: 2.75}", "stranger_alone: {mean: -4.25, sd: 0.5}"),
      {"fit_scale: stranger_alone: sd", "from 1"});
  expect_named(message("noise: 0.25", "psf_mm: 1"), {"psf_mm", "remove it", "spread_mm"});
  expect_named(message("noise: 0.25", "familiarity: {offset: 1}"),
               {"familiarity", "remove it", "stranger_alone"});
  expect_named(message("raw", "psi"), {"pressure_unit", "kPa or raw"});
  put_bytes(path_, "threshold: 3\n");
  expect_named(input_error([&] { read_sensor_model(path_); }), {"format", "palpate calibrate"});
  put_bytes(path_, "format: palpate.sensor_model\n---\nthreshold: 3\n");
  expect_named(input_error([&] { read_sensor_model(path_); }),
               {path_.c_str(), "line 2", "second document", "leave one"});
  put_bytes(path_, "a: [\n");
  expect_named(input_error([&] { read_sensor_model(path_); }), {"line", "YAML"});
}

}  // namespace palpate::sensor_model_file_test
