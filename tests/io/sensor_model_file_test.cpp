#include <gtest/gtest.h>

#include "file_parts.hpp"
#include "palpate/learned_sensor.hpp"

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

class SensorModelFile : public OneFile {
 protected:
  SensorModelFile() : OneFile("sensor.yaml") {}

  std::string written(const LearnedSensor& sensor) const {
    write_sensor_model(path_, sensor);
    return bytes_of(path_);
  }
  std::string message(const std::string& text) const {
    put_bytes(path_, text);
    return refusal([&] { read_sensor_model(path_); });
  }
};

int main_();
TEST_F(SensorModelFile, P) { std::puts(written(full_sensor()).c_str()); }
}  // namespace palpate::sensor_model_file_test
