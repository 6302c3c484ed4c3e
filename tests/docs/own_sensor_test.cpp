// Every command of docs/own_sensor.md and docs/own_presses.md runs, and ends in what the pages
// tell.

#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "document.hpp"

namespace palpate::own_sensor_test {

using OwnSensorDocument = DocumentTest;

// Some 34 seconds of a processor: the sensor of an array of 256 elements is learned, and 18 touches
// are recognised with it, each alone.
TEST_F(OwnSensorDocument, ItsCommandsFindTheUnknown) {
  const auto [said, complained] = run("own_sensor.md");
  EXPECT_EQ(complained, "") << "the logs of the page are in order";
  EXPECT_EQ(said.find("Suspicious"), said.npos);
  expect_written({"maps.png", "drawn.png", "maps/sensor.yaml", "sheets/unknown.png"});

  const nlohmann::json records = json("result.json");
  ASSERT_EQ(records.size(), 1u);
  const nlohmann::json& record = records[0];
  EXPECT_EQ(record["best"], "A");
  EXPECT_EQ(record["fit"]["verdict"], "fits");
  EXPECT_FALSE(record.contains("warnings")) << record["warnings"];
  // The truth is not in the logs: object=-446.41:26.795:-30 is T_object_robot.
  const std::array truth{400.0, 200.0, std::numbers::pi / 6.0};
  // Half an element's pitch; half an element over the 12.5 mm from the letter's middle to its ends.
  const std::array largest_error{1.0, 1.0, 1.0 / 12.5};
  const nlohmann::json& refined = record["refined"];
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const double error = refined["T_robot_object"][k].get<double>() - truth[k];
    EXPECT_LT(std::abs(error), largest_error[k]) << k;
    // One in 16,000 normal errors is larger.
    EXPECT_LT(std::abs(error), 4.0 * refined["sd"][k].get<double>()) << k;
  }

  std::istringstream lines(bytes_of(folder_ / "live.json"));
  std::string line;
  nlohmann::json live;
  while (std::getline(lines, line)) {
    live = nlohmann::json::parse(line);
  }
  EXPECT_EQ(live["best"], record["best"]);
  EXPECT_EQ(live["fit"]["verdict"], record["fit"]["verdict"]);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    // `live` cannot look ahead for what the array reads untouched, as `touches` does.
    EXPECT_NEAR(live["refined"]["T_robot_object"][k].get<double>(),
                refined["T_robot_object"][k].get<double>(), refined["sd"][k].get<double>());
  }

  // The page says that the sensor model brings the poses nearer to the truth, by more than half.
  const nlohmann::json before = scores("before.json");
  const nlohmann::json after = scores("after.json");
  EXPECT_EQ(before["accuracy"], 1.0);
  EXPECT_EQ(after["accuracy"], 1.0);
  EXPECT_LT(after["refined_error_mm"]["median"].get<double>(),
            0.5 * before["refined_error_mm"]["median"].get<double>());
}

// Without any pose: 4 letters and one that was never learned. Some 17 seconds of a processor, most
// to find where presses lie on each other.
TEST_F(OwnSensorDocument, PressesAtUnknownPosesMakeARecogniser) {
  const auto [said, complained] = run("own_presses.md");
  EXPECT_EQ(complained, "") << "the logs of the page are in order";
  expect_written({"maps.png"});

  const nlohmann::json found = scores("results.json");
  EXPECT_EQ(found["records"], 50);
  // The page says 37 of 40; of 200 such presses 92 % are right, so that fewer than 33 of 40 are one
  // time in 100.
  EXPECT_GE(found["known_classes"]["right"].get<int>(), 33);
  EXPECT_LT(found["known_classes"]["log_loss"].get<double>(), 0.4);
  EXPECT_GT(found["unknown_classes"]["area_under_curve"]["area"].get<double>(), 0.85);
}

}  // namespace palpate::own_sensor_test
